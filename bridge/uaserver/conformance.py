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
    """A profile or facet: ``table`` of OPC 10000-7 has it, ``includes`` are the names of its parts."""

    name: str
    uri: str
    table: int
    includes: tuple[str, ...]
    units: tuple[ConformanceUnit, ...]


_WIRE: Final = "tests/wire/opcua/"
_UNIT: Final = "tests/unit/uaserver/"
_FOREIGN_CLIENT: Final = f"{_WIRE}test_node.py::test_node_opcua_browses_reads_writes_subscribes_and_calls"
_ROOM: Final = f"{_WIRE}test_conformance.py::test_there_is_room_for_what_the_standard_profile_asks"
_PUBLISHES: Final = f"{_WIRE}test_conformance.py::test_ten_publish_requests_may_wait"
_SESSIONS: Final = f"{_WIRE}test_conformance.py::test_fifty_sessions_are_served_at_a_time"
_WRONG_LOGINS: Final = f"{_WIRE}test_crowds.py::test_wrong_passwords_hold_up_no_right_one"
_HANDLES: Final = (
    f"{_WIRE}test_service_subscriptions.py::TestSubscriptions::test_what_waits_can_be_cancelled_by_its_handle"
)
_CONTINUATION_POINTS: Final = (
    f"{_WIRE}test_services.py::TestBrowse::test_continuation_points_are_not_without_end"
)
_ATTRIBUTES: Final = f"{_WIRE}test_attributes.py::test_no_attribute_of_any_node_is_good_and_null"
_WHOLE: Final = f"{_WIRE}test_attributes.py::test_every_variable_is_read_and_written_whole"
_SELF_DESCRIPTION: Final = f"{_WIRE}test_attributes.py::test_what_the_server_says_of_itself_is_read"

_ALL: Final = (
    Profile(
        "SecurityPolicy – None",
        "",
        183,
        (),
        (
            ConformanceUnit("AsymmetricEncryptionAlgorithm_None", _FOREIGN_CLIENT),
            ConformanceUnit("AsymmetricSignatureAlgorithm_None", _FOREIGN_CLIENT),
            ConformanceUnit("KeyDerivationAlgorithm_None", _FOREIGN_CLIENT),
            ConformanceUnit(
                "Security None CreateSession ActivateSession",
                f"{_WIRE}test_channels.py::"
                "test_a_session_on_an_open_channel_that_is_for_endpoints_alone_is_told_as_such",
            ),
            ConformanceUnit("Security None CreateSession ActivateSession 1.0", is_optional=True),
            ConformanceUnit("SecurtyPolicy_None_Limits"),
            ConformanceUnit("SymmetricEncryptionAlgorithm_None", _FOREIGN_CLIENT),
            ConformanceUnit("SymmetricSignatureAlgorithm_None", _FOREIGN_CLIENT),
        ),
    ),
    Profile(
        "User Token – User Name Password Server Facet",
        "",
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
        "",
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
        "",
        25,
        (
            "SecurityPolicy – None",
            "User Token – User Name Password Server Facet",
        ),
        (
            ConformanceUnit("Address Space Atomicity", _WHOLE),
            ConformanceUnit("Address Space Base", _ATTRIBUTES),
            ConformanceUnit("Address Space Full Array Only", _WHOLE),
            ConformanceUnit(
                "Attribute Read",
                f"{_WIRE}test_points.py::TestNames::test_every_point_of_the_image_is_there_and_readable",
            ),
            ConformanceUnit("Attribute Write Index", is_optional=True),
            ConformanceUnit(
                "Attribute Write Values",
                f"{_WIRE}test_points.py::TestWrites::test_any_integer_type_is_taken",
                is_optional=True,
            ),
            ConformanceUnit("Base Info Core Structure", _SELF_DESCRIPTION),
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
                "Session Base",
                f"{_WIRE}test_session_states.py::test_every_service_is_answered_as_the_table_says",
            ),
            ConformanceUnit("Session General Service Behaviour", _HANDLES),
            ConformanceUnit("Session Minimum 1", _FOREIGN_CLIENT),
            ConformanceUnit("View Basic", f"{_WIRE}test_services.py::TestBrowse::test_what_is_left_follows"),
            ConformanceUnit("View Minimum Continuation Point 01", _CONTINUATION_POINTS),
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
                "Monitor Basic",
                f"{_WIRE}test_service_items.py::TestItems::test_the_settings_are_those_that_are_used",
            ),
            ConformanceUnit("Monitor Items 2", _ROOM),
            ConformanceUnit(
                "Monitor QueueSize_1",
                f"{_UNIT}subscriptions/test_items.py::test_a_full_queue_loses_what_the_client_chose_and_says_so",
            ),
            ConformanceUnit(
                "Monitor Value Change",
                f"{_WIRE}test_service_items.py::TestItems::test_no_more_is_sampled_than_was_asked_for",
            ),
            ConformanceUnit(
                "Subscription Basic",
                f"{_WIRE}test_service_subscriptions.py::"
                "TestSubscriptions::test_what_is_revised_is_what_is_used",
            ),
            ConformanceUnit("Subscription Minimum 1", _ROOM),
            ConformanceUnit(
                "Subscription Publish Discard Policy",
                f"{_UNIT}subscriptions/test_publishing.py::"
                "test_what_is_too_old_or_too_many_or_of_a_lost_connection_is_not_used",
            ),
            ConformanceUnit("Subscription Publish Min 02", _HANDLES),
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
                f"{_WIRE}test_service_items.py::TestItems::test_a_percent_deadband_is_a_part_of_the_range",
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
            ConformanceUnit("Base Info Type System", _ATTRIBUTES),
            ConformanceUnit("Security – No Application Authentication", is_optional=True),
            ConformanceUnit(
                "Security Default ApplicationInstance Certificate",
                f"{_WIRE}test_security.py::"
                "TestTrust::test_the_server_s_identity_stays_over_a_restart_under_another_host_name",
            ),
            ConformanceUnit(
                "Security Policy Required",
                f"{_WIRE}test_security.py::"
                "TestEncrypted::test_no_session_is_opened_without_security_that_is_not_offered",
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
            ConformanceUnit(
                "Monitor MinQueueSize_05",
                f"{_UNIT}subscriptions/test_items.py::test_the_queue_size_is_revised_to_what_is_used",
            ),
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
            ConformanceUnit("Discovery Register"),
            ConformanceUnit(
                "Discovery Register2",
                f"{_WIRE}test_discovery.py::test_a_discovery_server_names_it_as_long_as_it_runs",
            ),
            ConformanceUnit("Session Cancel", _HANDLES),
            ConformanceUnit("Session Change User", is_optional=True),
            ConformanceUnit("Session Minimum 50 Parallel", _SESSIONS),
            ConformanceUnit("View Minimum Continuation Point 05", _CONTINUATION_POINTS),
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
