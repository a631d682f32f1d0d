"""SDO transfers in words for the monitor (CiA 301 v4.2.0 §7.2.4.3): what a frame says, of which object."""

from __future__ import annotations

import pytest

from bridge.canopen.decode_sdo import SdoListener, SdoSaid, shown
from tests.support.sdo_block import LONG, Link, once


def heard(*lines: str, listener: SdoListener | None = None) -> list[SdoSaid]:
    """Meanings of these frames: "> …" is from the client, "< …" from the server."""
    channel = listener or SdoListener()
    sides = {">": channel.request, "<": channel.reply}
    return [sides[line[0]](bytes.fromhex(line[1:])) for line in lines]


def texts(*lines: str, listener: SdoListener | None = None) -> list[str]:
    return [said.text for said in heard(*lines, listener=listener)]


@pytest.mark.parametrize(
    ("line", "text", "values"),
    [
        ("> 40 18 10 02 00 00 00 00", "read 1018h:02", {"operation": "read", "index": "1018", "sub": 2}),
        ("> 2F 60 60 00 08 00 00 00", "write 6060h:00 := 8 (08h)", {"operation": "write", "data": "08"}),
        ("> 27 00 20 00 01 02 03 00", "write 2000h:00 := 01 02 03", {"data": "010203"}),
        ("> 22 00 20 00 01 02 03 04", "write 2000h:00 := 67305985 (04030201h)", {"data": "01020304"}),
        ("> 21 00 20 00 09 01 00 00", "write 2000h:00: 265 bytes in segments", {"operation": "write"}),
        ("> 20 00 20 00 09 00 00 00", "write 2000h:00: bytes in segments", {"operation": "write"}),
        ("> 60 00 00 00 00 00 00 00", "read 0000h:00: next segment", {"operation": "read"}),
        ("> 70 00 00 00 00 00 00 00", "read 0000h:00: next segment", {"operation": "read"}),
        ("> A4 08 10 00 7F 00 00 00", "block read 1008h:00", {"operation": "read", "index": "1008"}),
        ("> C6 00 20 01 09 00 00 00", "block write 2000h:01", {"operation": "write", "sub": 1}),
        ("> C5 11 22 00 00 00 00 00", "block write 0000h:00: end", {"operation": "write"}),
        ("> E0 00 20 00 00 00 00 00", "SDO request with unknown command E0h", {}),
        ("> 81 00 20 00 00 00 00 00", "SDO request with unknown command 81h", {}),
        ("> 40 18 10", "SDO request of 3 bytes", {}),
        ("> 40 18 10 02 00 00 00 00 00", "SDO request of 9 bytes", {}),
        ("< 4F 60 60 00 08 00 00 00", "6060h:00 = 8 (08h)", {"operation": "read", "data": "08"}),
        ("< 42 00 20 00 01 02 03 04", "2000h:00 = 67305985 (04030201h)", {"data": "01020304"}),
        ("< 41 08 10 00 09 01 00 00", "1008h:00: 265 bytes in segments", {"operation": "read"}),
        ("< 40 08 10 00 09 00 00 00", "1008h:00: bytes in segments", {"operation": "read"}),
        ("< 60 17 10 03 00 00 00 00", "1017h:03 written", {"operation": "write", "index": "1017", "sub": 3}),
        ("< 30 00 00 00 00 00 00 00", "0000h:00: segment taken", {"operation": "write"}),
        ("< C6 08 10 01 0A 01 00 00", "block read 1008h:01: 266 bytes", {"operation": "read", "sub": 1}),
        ("< C4 08 10 00 0A 00 00 00", "block read 1008h:00: bytes", {"operation": "read", "index": "1008"}),
        ("< C1 11 22 00 00 00 00 00", "block read 0000h:00: end", {"operation": "read"}),
        ("< A4 00 20 01 7F 00 00 00", "block write 2000h:01: blocks of 127 segments", {"operation": "write"}),
        ("< E0 00 20 00 00 00 00 00", "SDO answer with unknown command E0h", {}),
        ("< 81 00 20 00 00 00 00 00", "SDO answer with unknown command 81h", {}),
        ("<", "SDO answer of 0 bytes", {}),
        (
            "> 80 18 10 01 00 00 04 05",
            "1018h:01: the client aborts: SDO protocol timed out (05040000h)",
            {"operation": "abort", "index": "1018", "sub": 1, "abort_code": "05040000"},
        ),
        (
            "< 80 18 10 05 11 00 09 06",
            "1018h:05: the node aborts: sub-index does not exist (06090011h)",
            {"operation": "abort", "abort_code": "06090011", "abort_text": "sub-index does not exist"},
        ),
    ],
)
def test_what_one_frame_says(line: str, text: str, values: dict[str, int | str]) -> None:
    [said] = heard(line)
    assert said.text == text
    facts = dict(said.values)
    assert facts == facts | values
    assert bool(facts) is bool(values)


@pytest.mark.parametrize("index", ["00 20", "01 20"])
def test_of_a_long_write_the_length_is_told_where_the_client_announces_it(index: str) -> None:
    [sized] = heard(f"> 21 {index} 00 09 01 00 00")
    assert (sized.act, sized.number) == ("write_long", 265)
    [unsized] = heard(f"> 20 {index} 00 09 01 00 00")
    assert (unsized.act, unsized.number) == ("write_long", None)


def test_a_string_is_written_in_segments_and_then_another_one_is_read() -> None:
    """The segments do not name their object, and no value begins with what is left of the one before."""
    listener = SdoListener()
    written = heard(
        "> 21 08 20 01 09 00 00 00",
        "< 60 08 20 01 00 00 00 00",
        "> 00 41 42 43 44 45 46 47",
        "< 20 00 00 00 00 00 00 00",
        "> 1B 48 49 00 00 00 00 00",
        "< 30 00 00 00 00 00 00 00",
        listener=listener,
    )
    assert [said.text for said in written] == [
        "write 2008h:01: 9 bytes in segments",
        "2008h:01 written",
        "2008h:01: segment",
        "2008h:01: segment taken",
        '2008h:01 := "ABCDEFGHI"',
        "2008h:01: segment taken",
    ]
    assert [dict(said.values)["operation"] for said in written] == ["write"] * 6
    assert dict(written[4].values)["data"] == b"ABCDEFGHI".hex()
    read = heard(
        "> 40 08 10 00 00 00 00 00",
        "< 41 08 10 00 0A 00 00 00",
        "> 60 00 00 00 00 00 00 00",
        "< 00 61 62 63 64 65 66 67",
        "> 70 00 00 00 00 00 00 00",
        "< 19 68 69 6A 00 00 00 00",
        listener=listener,
    )
    assert [said.text for said in read[3:]] == [
        "1008h:00: segment",
        "read 1008h:00: next segment",
        '1008h:00 = "abcdefghij"',
    ]
    assert [dict(said.values)["operation"] for said in read] == ["read"] * 6


@pytest.mark.parametrize("length", [1, 7, 8, 4095, 4096, 4097, 9000])
def test_of_a_long_value_the_beginning_is_kept(length: int) -> None:
    """At most 4096 bytes, in whole segments."""
    listener = SdoListener()
    value = bytes(n % 251 for n in range(length))
    texts("> 40 08 10 00 00 00 00 00", "< 40 08 10 00 00 00 00 00", listener=listener)
    for at in range(0, length, 7):
        part = value[at : at + 7]
        command = (7 - len(part)) << 1 | (at + 7 >= length)
        [said] = heard(f"< {command:02X} {part.ljust(7, b'-').hex()}", listener=listener)
    kept = value if length <= 4096 else value[:4095]
    assert bytes.fromhex(str(dict(said.values)["data"])) == kept


# blocks: their segments begin with a sequence number, and look like commands

BLOCK_WRITE = [
    ("> C6 00 20 01 14 00 00 00", "block write 2000h:01"),
    ("< A4 00 20 01 02 00 00 00", "block write 2000h:01: blocks of 2 segments"),
    ("> 01 40 41 42 43 44 45 46", "2000h:01: block segment 1"),
    ("> 02 47 48 49 4A 4B 4C 4D", "2000h:01: block segment 2"),
    ("< A2 02 02 00 00 00 00 00", "2000h:01: segments up to 2 taken"),
    ("> 81 4E 4F 50 51 52 53 00", "2000h:01: block segment 1, the last"),
    ("< A2 01 02 00 00 00 00 00", "2000h:01: segments up to 1 taken"),
    ("> C5 12 34 00 00 00 00 00", "block write 2000h:01: end"),
    ("< A1 00 00 00 00 00 00 00", "block write 2000h:01: end confirmed"),
]
BLOCK_READ = [
    ("> A4 08 10 01 02 00 00 00", "block read 1008h:01"),
    ("< C6 08 10 01 14 00 00 00", "block read 1008h:01: 20 bytes"),
    ("> A3 00 00 00 00 00 00 00", "block read 1008h:01: start"),
    ("< 01 40 41 42 43 44 45 46", "1008h:01: block segment 1"),
    ("< 02 47 48 49 4A 4B 4C 4D", "1008h:01: block segment 2"),
    ("> A2 02 02 00 00 00 00 00", "1008h:01: segments up to 2 taken"),
    ("< 81 4E 4F 50 51 52 53 00", "1008h:01: block segment 1, the last"),
    ("> A2 01 02 00 00 00 00 00", "1008h:01: segments up to 1 taken"),
    ("< C5 12 34 00 00 00 00 00", "block read 1008h:01: end"),
    ("> A1 00 00 00 00 00 00 00", "block read 1008h:01: end confirmed"),
]
AFTER = [
    ("> 40 00 10 00 00 00 00 00", "read 1000h:00"),
    ("< 43 00 10 00 92 01 02 00", "1000h:00 = 131474 (00020192h)"),
    ("> 2B 17 10 00 F4 01 00 00", "write 1017h:00 := 500 (01F4h)"),
    ("< 60 17 10 00 00 00 00 00", "1017h:00 written"),
]


@pytest.mark.parametrize(("transfer", "operation"), [(BLOCK_WRITE, "write"), (BLOCK_READ, "read")])
def test_a_transfer_in_blocks_is_followed_to_its_end_and_so_is_what_comes_after(
    transfer: list[tuple[str, str]], operation: str
) -> None:
    listener = SdoListener()
    said = heard(*(line for line, _ in transfer), listener=listener)
    assert [one.text for one in said] == [text for _, text in transfer]
    assert {dict(one.values)["operation"] for one in said} == {operation}
    assert texts(*(line for line, _ in AFTER), listener=listener) == [text for _, text in AFTER]


@pytest.mark.parametrize(
    ("transfer", "segments", "end"),
    [
        (BLOCK_WRITE, 3, "< 80 00 20 01 20 00 04 05"),
        (BLOCK_WRITE, 3, "> 80 00 20 01 20 00 04 05"),
        (BLOCK_READ, 4, "< 80 08 10 01 20 00 04 05"),
        (BLOCK_READ, 4, "> 80 08 10 01 20 00 04 05"),
    ],
)
def test_an_abort_ends_it_in_the_midst_of_a_block(
    transfer: list[tuple[str, str]], segments: int, end: str
) -> None:
    listener = SdoListener()
    texts(*(line for line, _ in transfer[:segments]), end, listener=listener)
    assert texts(*(line for line, _ in AFTER), listener=listener) == [text for _, text in AFTER]


def test_a_client_that_gives_up_without_a_word_may_begin_anew() -> None:
    listener = SdoListener()
    texts(*(line for line, _ in BLOCK_READ[:4]), listener=listener)
    assert texts(*(line for line, _ in AFTER), listener=listener) == [text for _, text in AFTER]


def test_the_last_segment_is_sent_again_where_it_was_lost() -> None:
    """§7.2.4.3.11: the server acknowledges the last one that it has; the client numbers the rest from 1."""
    listener = SdoListener()
    begin = ["> C6 00 20 00 0E 00 00 00", "< A4 00 20 00 7F 00 00 00"]
    texts(*begin, "> 01 40 41 42 43 44 45 46", "> 82 47 48 49 4A 4B 4C 4D", listener=listener)
    again = ["< A2 01 7F 00 00 00 00 00", "> 81 47 48 49 4A 4B 4C 4D", "< A2 01 7F 00 00 00 00 00"]
    assert texts(*again, "> C1 12 34 00 00 00 00 00", listener=listener) == [
        "2000h:00: segments up to 1 taken",
        "2000h:00: block segment 1, the last",
        "2000h:00: segments up to 1 taken",
        "block write 2000h:00: end",
    ]


@pytest.mark.parametrize(
    ("begin", "acknowledged", "resent"),
    [
        ([line for line, _ in BLOCK_WRITE[:2]], "< A2 00 7F 00 00 00 00 00", "> 01 40 41 42 43 44 45 46"),
        ([line for line, _ in BLOCK_READ[:3]], "> A2 00 7F 00 00 00 00 00", "< 01 40 41 42 43 44 45 46"),
    ],
)
def test_a_block_of_which_nothing_came_is_sent_again(
    begin: list[str], acknowledged: str, resent: str
) -> None:
    assert texts(*begin, acknowledged, resent)[-1].endswith("block segment 1")


@pytest.mark.parametrize("is_read", [False, True])
@pytest.mark.parametrize(("way", "lost"), [("to", -1), ("to", 0x05), ("from", 0x05), ("from", 0xA2)])
def test_the_bridges_own_transfers_are_understood_though_frames_are_lost(
    is_read: bool, way: str, lost: int
) -> None:
    link = Link(lose=once(way, lost), retries=2)
    if is_read:
        link.read()
    else:
        link.write(LONG)
    assert len(link.log) > 150
    assert not [text for text in texts(*link.log) if "unknown" in text]


# values of unknown type


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ("2A", "42 (2Ah)"),
        ("41", "65 (41h)"),
        ("41 42", "16961 (4241h)"),
        ("01 02 03", "01 02 03"),
        ("41 42 43", '"ABC"'),
        ("41 42 43 44", '1145258561 (44434241h, "ABCD")'),
        ("41 42 43 00", "4407873 (00434241h)"),
        ("20 7E 20 7E", '2116058656 (7E207E20h, " ~ ~")'),
        ("41 42 43 44 45", '"ABCDE"'),
        ("41 42 43 44 00 00 00", '"ABCD"'),
        ("41 42 1F 44 45", "41 42 1F 44 45"),
        ("41 42 7F 44 45", "41 42 7F 44 45"),
        ("41 C4 42 43 45", "41 C4 42 43 45"),
        ("00 00 00", "00 00 00"),
        ("01 00 00 00 00 00 00 80", "9223372036854775809 (8000000000000001h)"),
        ("41 42 43 44 45 46 47 48", "5208208757389214273 (4847464544434241h)"),
        ("", "nothing"),
    ],
)
def test_a_value_is_shown_as_a_number_as_text_or_as_bytes(value: str, text: str) -> None:
    assert shown(bytes.fromhex(value)) == text
