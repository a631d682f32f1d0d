"""Conformance units of the profiles that SCADA systems ask for (OPC 10000-7 §6.6), each with the test that
holds it.

``docs/reference/opcua-conformance.md`` is made from it, and ``ServerProfileArray`` names those profiles of
which every unit that is not optional is held.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final


@dataclass(frozen=True, slots=True)
class ConformanceUnit:
    """``test`` is the test that holds it, by its path; "" for one that is not served."""

    name: str
    test: str = ""
    is_optional: bool = False


@dataclass(frozen=True, slots=True)
class Profile:
    """A profile or facet: ``table`` of OPC 10000-7 has it, ``includes`` are the names of its parts. ``uri``
    is "" for a security policy: endpoints name it, where it is offered."""

    name: str
    uri: str
    table: int
    includes: tuple[str, ...]
    units: tuple[ConformanceUnit, ...]


_WIRE: Final = "tests/wire/opcua/"
_CONFORMANCE: Final = f"{_WIRE}test_conformance.py::"
_FOREIGN_CLIENT: Final = f"{_WIRE}test_node.py::test_node_opcua_browses_reads_writes_subscribes_and_calls"
_NO_NONCE: Final = f"{_WIRE}test_policy_none.py::test_a_channel_has_no_nonce_and_no_keys"
_NO_SECURITY: Final = f"{_WIRE}test_policy_none.py::test_messages_are_as_they_are"
_ROOM: Final = f"{_CONFORMANCE}test_half_of_fifty_sessions_have_all_that_is_asked_at_a_time"
_PUBLISHES: Final = f"{_CONFORMANCE}test_ten_publish_requests_may_wait_and_ten_messages_for_a_republish"
_SESSIONS: Final = f"{_CONFORMANCE}test_fifty_sessions_are_served_at_a_time"
_QUEUES: Final = f"{_CONFORMANCE}test_a_queue_keeps_as_many_as_it_is_long"
_WRONG_LOGINS: Final = (
    f"{_WIRE}test_crowds.py::test_wrong_logins_are_answered_later_and_later_and_right_ones_at_once"
)
_WHOLE: Final = f"{_WIRE}test_attributes.py::test_every_variable_is_read_and_written_whole"
_SELF_DESCRIPTION: Final = f"{_WIRE}test_attributes.py::test_what_the_server_says_of_itself_is_read"

_ALL: Final = (
    Profile(
        "SecurityPolicy – None",
        "",
        183,
        (),
        (
            ConformanceUnit("AsymmetricEncryptionAlgorithm_None", _NO_NONCE),
            ConformanceUnit("AsymmetricSignatureAlgorithm_None", _NO_NONCE),
            ConformanceUnit("KeyDerivationAlgorithm_None", _NO_NONCE),
            ConformanceUnit(
                "Security None CreateSession ActivateSession",
                f"{_WIRE}test_policy_none.py::test_a_session_needs_no_nonce_no_certificate_and_no_signature",
            ),
            ConformanceUnit("Security None CreateSession ActivateSession 1.0", is_optional=True),
            ConformanceUnit("SecurtyPolicy_None_Limits", _NO_NONCE),
            ConformanceUnit("SymmetricEncryptionAlgorithm_None", _NO_SECURITY),
            ConformanceUnit("SymmetricSignatureAlgorithm_None", _NO_SECURITY),
        ),
    ),
    Profile(
        "User Token – User Name Password Server Facet",
        "http://opcfoundation.org/UA-Profile/Security/UserToken/Server/UserNamePassword",
        188,
        (),
        (
            ConformanceUnit("Security Invalid user token", _WRONG_LOGINS),
            ConformanceUnit(
                "Security User Name Password",
                f"{_WIRE}test_security.py::TestEncrypted::test_an_operator_with_a_password_commands",
            ),
        ),
    ),
    Profile(
        "User Token – X509 Certificate Server Facet",
        "http://opcfoundation.org/UA-Profile/Security/UserToken/Server/X509Certificate",
        189,
        (),
        (
            ConformanceUnit("Security Invalid user token", _WRONG_LOGINS),
            ConformanceUnit(
                "Security User X509",
                f"{_WIRE}test_certificates.py::TestUsers::test_who_has_the_key_is_the_user",
            ),
        ),
    ),
    Profile(
        "Core 2017 Server Facet",
        "http://opcfoundation.org/UA-Profile/Server/Core2017Facet",
        25,
        (
            "SecurityPolicy – None",
            "User Token – User Name Password Server Facet",
        ),
        (
            ConformanceUnit("Address Space Atomicity", _WHOLE),
            ConformanceUnit(
                "Address Space Base",
                f"{_WIRE}test_attributes.py::test_each_node_has_the_mandatory_attributes_of_its_class",
            ),
            ConformanceUnit("Address Space Full Array Only", _WHOLE),
            ConformanceUnit(
                "Attribute Read",
                f"{_CONFORMANCE}test_attributes_of_several_nodes_are_read_together_and_arrays_in_part",
            ),
            ConformanceUnit("Attribute Write Index", is_optional=True),
            ConformanceUnit(
                "Attribute Write Values",
                f"{_WIRE}test_points.py::TestWrites::test_any_integer_type_is_taken",
                is_optional=True,
            ),
            ConformanceUnit(
                "Base Info Core Structure",
                f"{_CONFORMANCE}test_the_address_space_has_the_structure_of_the_standard",
            ),
            ConformanceUnit(
                "Base Info Estimated Return Time",
                f"{_WIRE}test_ends.py::test_clients_are_told_at_once_and_have_their_time",
                is_optional=True,
            ),
            ConformanceUnit("Base Info OptionSet", is_optional=True),
            ConformanceUnit("Base Info Placeholder Modelling Rules", is_optional=True),
            ConformanceUnit("Base Info Selection List", is_optional=True),
            ConformanceUnit("Base Info Server Capabilities", _SELF_DESCRIPTION, is_optional=True),
            ConformanceUnit("Base Info ValueAsText", is_optional=True),
            ConformanceUnit(
                "Discovery Find Servers Self",
                f"{_WIRE}test_discovery.py::test_it_names_itself_to_who_looks_for_it",
            ),
            ConformanceUnit(
                "Discovery Get Endpoints",
                f"{_WIRE}test_services.py::test_only_endpoints_of_the_profiles_are_named",
            ),
            ConformanceUnit("Security Administration", is_optional=True),
            ConformanceUnit("Security Role Server Authorization", is_optional=True),
            ConformanceUnit(
                "Session Base", f"{_CONFORMANCE}test_a_session_is_made_activated_used_and_closed"
            ),
            ConformanceUnit(
                "Session General Service Behaviour",
                f"{_CONFORMANCE}test_a_request_is_answered_by_its_handle_with_what_it_asks_for",
            ),
            ConformanceUnit("Session Minimum 1", _FOREIGN_CLIENT),
            ConformanceUnit("View Basic", f"{_WIRE}test_services.py::TestBrowse::test_what_is_left_follows"),
            ConformanceUnit("View Minimum Continuation Point 01", _ROOM),
            ConformanceUnit(
                "View RegisterNodes", f"{_WIRE}test_services.py::test_a_node_is_registered_as_itself"
            ),
            ConformanceUnit(
                "View TranslateBrowsePath",
                f"{_WIRE}test_services.py::TestBrowse::test_a_path_has_each_target_once",
            ),
        ),
    ),
    Profile(
        "UA-TCP UA-SC UA-Binary",
        "http://opcfoundation.org/UA-Profile/Transport/uatcp-uasc-uabinary",
        165,
        (),
        (
            ConformanceUnit("Protocol UA TCP", _FOREIGN_CLIENT),
            ConformanceUnit("UA Binary Encoding", _FOREIGN_CLIENT),
            ConformanceUnit("UA Secure Conversation", _FOREIGN_CLIENT),
        ),
    ),
    Profile(
        "Nano Embedded Device 2017 Server Profile",
        "http://opcfoundation.org/UA-Profile/Server/NanoEmbeddedDevice2017",
        86,
        (
            "Core 2017 Server Facet",
            "UA-TCP UA-SC UA-Binary",
        ),
        (
            ConformanceUnit("Base Info Custom Type System", is_optional=True),
            ConformanceUnit(
                "Base Info Diagnostics",
                f"{_WIRE}test_diagnostics.py::test_an_engineer_sees_what_there_is",
                is_optional=True,
            ),
        ),
    ),
    Profile(
        "Embedded DataChange Subscription Server Facet",
        "http://opcfoundation.org/UA-Profile/Server/EmbeddedDataChangeSubscription",
        37,
        (),
        (
            ConformanceUnit(
                "Monitor Basic", f"{_CONFORMANCE}test_items_are_made_changed_switched_and_deleted"
            ),
            ConformanceUnit("Monitor Items 2", _ROOM),
            ConformanceUnit("Monitor QueueSize_1", _QUEUES),
            ConformanceUnit(
                "Monitor Value Change",
                f"{_CONFORMANCE}test_a_change_is_told_and_of_an_array_the_part_that_is_watched",
            ),
            ConformanceUnit(
                "Subscription Basic",
                f"{_CONFORMANCE}test_a_subscription_is_made_changed_switched_told_again_and_deleted",
            ),
            ConformanceUnit("Subscription Minimum 1", _ROOM),
            ConformanceUnit(
                "Subscription Publish Discard Policy",
                f"{_CONFORMANCE}test_of_too_many_publish_requests_the_oldest_is_answered",
            ),
            ConformanceUnit("Subscription Publish Min 02", _PUBLISHES),
        ),
    ),
    Profile(
        "Micro Embedded Device 2017 Server Profile",
        "http://opcfoundation.org/UA-Profile/Server/MicroEmbeddedDevice2017",
        89,
        (
            "Embedded DataChange Subscription Server Facet",
            "Nano Embedded Device 2017 Server Profile",
        ),
        (ConformanceUnit("Session Minimum 2 Parallel", _SESSIONS),),
    ),
    Profile(
        "Standard DataChange Subscription 2017 Server Facet",
        "http://opcfoundation.org/UA-Profile/Server/StandardDataChangeSubscription2017",
        39,
        ("Embedded DataChange Subscription Server Facet",),
        (
            ConformanceUnit(
                "Base Info GetMonitoredItems Method",
                f"{_WIRE}test_conformance.py::test_a_client_that_has_forgotten_its_items_asks_for_them",
            ),
            ConformanceUnit(
                "Base Info ResendData Method",
                f"{_WIRE}test_conformance.py::test_values_are_sent_again_to_who_asks",
            ),
            ConformanceUnit(
                "Method Call", f"{_WIRE}test_methods.py::TestMethods::test_a_drive_is_started_and_stopped"
            ),
            ConformanceUnit("Monitor Items 10", _ROOM),
            ConformanceUnit("Monitor Items 100", _ROOM),
            ConformanceUnit(
                "Monitor MinQueueSize_02",
                f"{_WIRE}test_service_items.py::TestItems::test_a_full_queue_says_what_is_lost",
            ),
            ConformanceUnit(
                "Monitor Triggering",
                f"{_WIRE}test_service_items.py::"
                "TestItems::test_an_item_that_samples_is_told_once_another_has_something",
            ),
            ConformanceUnit(
                "Monitored Items Deadband Filter",
                f"{_CONFORMANCE}test_an_absolute_deadband_is_in_the_unit_of_the_value",
            ),
            ConformanceUnit("Subscription Minimum 02", _ROOM),
            ConformanceUnit("Subscription Publish Min 05", _PUBLISHES),
        ),
    ),
    Profile(
        "Embedded 2017 UA Server Profile",
        "http://opcfoundation.org/UA-Profile/Server/EmbeddedUA2017",
        91,
        (
            "Micro Embedded Device 2017 Server Profile",
            "Standard DataChange Subscription 2017 Server Facet",
        ),
        (
            ConformanceUnit(
                "Base Info Engineering Units",
                f"{_WIRE}test_points.py::TestNames::test_a_number_with_a_unit_says_which_and_how_far",
                is_optional=True,
            ),
            ConformanceUnit(
                "Base Info Type System",
                f"{_WIRE}test_attributes.py::test_each_type_that_is_used_is_there_below_its_root",
            ),
            ConformanceUnit("Security – No Application Authentication", is_optional=True),
            ConformanceUnit(
                "Security Default ApplicationInstance Certificate",
                f"{_WIRE}test_security.py::"
                "TestTrust::test_the_server_s_identity_stays_over_a_restart_under_another_host_name",
            ),
            ConformanceUnit(
                "Security Policy Required",
                f"{_WIRE}test_security.py::TestEncrypted::test_an_operator_with_a_password_commands",
            ),
        ),
    ),
    Profile(
        "Enhanced DataChange Subscription 2017 Server Facet",
        "http://opcfoundation.org/UA-Profile/Server/EnhancedDataChangeSubscription2017",
        40,
        ("Standard DataChange Subscription 2017 Server Facet",),
        (
            ConformanceUnit("Monitor Items 500", _ROOM),
            ConformanceUnit("Monitor MinQueueSize_05", _QUEUES),
            ConformanceUnit("Subscription Minimum 05", _ROOM),
            ConformanceUnit("Subscription Publish Min 10", _PUBLISHES),
        ),
    ),
    Profile(
        "Standard 2017 UA Server Profile",
        "http://opcfoundation.org/UA-Profile/Server/StandardUA2017",
        93,
        (
            "Embedded 2017 UA Server Profile",
            "Enhanced DataChange Subscription 2017 Server Facet",
            "User Token – X509 Certificate Server Facet",
        ),
        (
            ConformanceUnit("Attribute Write StatusCode & Timestamp", is_optional=True),
            ConformanceUnit(
                "Base Info Diagnostics",
                f"{_WIRE}test_diagnostics.py::test_each_session_is_found_by_browsing_and_goes_with_its_end",
            ),
            ConformanceUnit(
                "Discovery Register",
                f"{_WIRE}test_discovery.py::"
                "test_a_discovery_server_that_knows_no_registerserver2_names_it_as_well",
            ),
            ConformanceUnit(
                "Discovery Register2",
                f"{_WIRE}test_discovery.py::test_a_discovery_server_names_it_as_long_as_it_runs",
            ),
            ConformanceUnit(
                "Session Cancel",
                f"{_WIRE}test_service_subscriptions.py::TestSubscriptions::test_what_waits_can_be_cancelled_by_its_handle",
            ),
            ConformanceUnit("Session Change User", is_optional=True),
            ConformanceUnit("Session Minimum 50 Parallel", _SESSIONS),
            ConformanceUnit("View Minimum Continuation Point 05", _ROOM),
        ),
    ),
)

PROFILES: Final[Mapping[str, Profile]] = {one.name: one for one in _ALL}
"""Profiles by their names, those that are part of another before it."""


def units_of(profile: Profile) -> Iterator[ConformanceUnit]:
    """Units of a profile, with those of what it includes."""
    for name in profile.includes:
        yield from units_of(PROFILES[name])
    yield from profile.units


def claimed() -> list[str]:
    """URIs of the profiles of which each unit that is not optional is held."""
    return [
        one.uri
        for one in PROFILES.values()
        if one.uri and all(unit.test or unit.is_optional for unit in units_of(one))
    ]
