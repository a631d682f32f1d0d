"""Access rights of each zenoh link, as zenoh's ``access_control``. Sans-IO.

Only the bridge publishes, answers and holds tokens below ``<prefix>/<site>/``, and it forwards nothing
between its links. So nobody can pose as the bridge, or block it by waiting for another client.
"""

from __future__ import annotations

from collections.abc import Sequence

from bridge.northbound.zenoh.keys import KeySpace
from bridge.northbound.zenoh.users import Users

_EVERYTHING = ("**", "*/**/@/**")
"""``**`` does not match chunks that begin with ``@``; keys that begin with one are zenoh's own."""


def access_control(keys: KeySpace, users: Users, *, accept_put: bool) -> dict[str, object]:
    """Without a rule that allows it, nothing passes in either direction."""
    told = ("declare_subscriber", "declare_liveliness_subscriber", "liveliness_query")
    rules: list[dict[str, object]] = [
        _rule("ask", "ingress", ("query",), ("**",)),
        _rule("follow", "ingress", told, _EVERYTHING),
        _rule("answer", "egress", ("reply",), _EVERYTHING),
        _rule("publish", "egress", ("put",), (keys.everything, f"{keys.top}/@/event/**")),
        _rule("serve", "egress", ("declare_queryable",), (keys.everything, keys.controllers)),
        _rule("live", "egress", ("liveliness_token",), (f"{keys.top}/@/*",)),
    ]
    if accept_put:
        rules += [
            _rule("put", "ingress", ("put",), (keys.commands,)),
            _rule("take puts", "egress", ("declare_subscriber",), (keys.commands, keys.own_commands)),
        ]
    everybody = [rule["id"] for rule in rules]
    subjects: list[dict[str, object]] = [{"id": "everybody"}]
    policies: list[dict[str, object]] = [{"rules": everybody, "subjects": ["everybody"]}]
    for name in users.controllers:
        messages = ("query", "put") if accept_put else ("query",)
        rules.append(_rule(f"command as {name}", "ingress", messages, (keys.own_keys(name),)))
        subjects.append({"id": f"user {name}", "usernames": [name]})
        subjects.append({"id": f"certificate {name}", "cert_common_names": [name]})
        policies.append(
            {"rules": [f"command as {name}"], "subjects": [f"user {name}", f"certificate {name}"]}
        )
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rule(name: str, flow: str, messages: Sequence[str], keys: Sequence[str]) -> dict[str, object]:
    return {
        "id": name,
        "messages": list(messages),
        "flows": [flow],
        "permission": "allow",
        "key_exprs": list(keys),
    }
