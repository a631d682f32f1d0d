"""XDD and XDC give the same as an EDS, and no XML reaches out of its text."""

from __future__ import annotations

import pytest

from bridge.base.errors import FileFaults
from bridge.eds import Access, FindingSeverity, StaticDataType, Value, configuration, read_device

XDD = """<?xml version="1.0" encoding="utf-8"?>
<ISO15745ProfileContainer xmlns="http://www.canopen.org/xml/1.1"
    xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance">
<ISO15745Profile><ProfileBody xsi:type="ProfileBody_Device_CANopen">
 <DeviceIdentity>
  <vendorName>Acme</vendorName><vendorID>0x0000003B</vendorID>
  <productName>Mover</productName><productID>07</productID>
 </DeviceIdentity>
 <ApplicationProcess><parameterList>
  <parameter uniqueID="P1" access="readWrite"><UINT/><defaultValue value="0x12"/></parameter>
 </parameterList></ApplicationProcess>
</ProfileBody></ISO15745Profile>
<ISO15745Profile><ProfileBody xsi:type="ProfileBody_CommunicationNetwork_CANopen">
 <ApplicationLayers><CANopenObjectList>
  <CANopenObject index="1000" name="Device Type" objectType="7" dataType="0007" accessType="ro"
    defaultValue="0x00010192" PDOmapping="no"/>
  <CANopenObject index="1800" name="TPDO1" objectType="9" subNumber="2">
   <CANopenSubObject subIndex="00" name="Count" objectType="7" dataType="0005" accessType="ro"
     defaultValue="1"/>
   <CANopenSubObject subIndex="01" name="COB-ID" objectType="7" dataType="0007" accessType="rw"
     defaultValue="$NODEID+0x180" actualValue="0x185"/>
  </CANopenObject>
  <CANopenObject index="2000" name="Speed" objectType="7" uniqueIDRef="P1" PDOmapping="optional"/>
 </CANopenObjectList></ApplicationLayers>
 <TransportLayers><PhysicalLayer><baudRate defaultValue="250 Kbps">
  <supportedBaudRate value="250 Kbps"/></baudRate></PhysicalLayer></TransportLayers>
 <NetworkManagement>
  <deviceCommissioning nodeID="6" nodeName="lift" actualBaudRate="250 Kbps"/></NetworkManagement>
</ProfileBody></ISO15745Profile>
</ISO15745ProfileContainer>
"""

BOMB = """<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>"""
OUTSIDE = """<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>"""


def test_an_xdc_is_read_without_findings() -> None:
    description = read_device(XDD.encode(), "test.xdc")
    assert description.findings == ()
    assert description.format == "XDC"
    assert (description.device_info.vendor, description.device_info.vendor_id) == ("Acme", 0x3B)
    assert (description.device_info.product_code, description.device_info.bitrates) == (7, (250_000,))
    assert (description.commissioning.node_id, description.commissioning.bitrate) == (6, 250_000)
    assert [one.index for one in description.objects] == [0x1000, 0x1800, 0x2000]
    assert description.number(0x1800, 1) == 0x185


def test_a_parameter_of_the_application_process_tells_the_rest() -> None:
    speed = read_device(XDD.encode(), "test.xdc").entry(0x2000)
    assert speed
    assert (speed.data_type, speed.access, speed.default) == (
        StaticDataType.UNSIGNED16,
        Access.RW,
        Value(0x12),
    )
    assert speed.pdo_mappable


def test_what_equals_the_default_on_this_node_is_not_downloaded() -> None:
    description = read_device(XDD.encode(), "test.xdc")
    assert configuration(description, 5) == ()
    [download] = configuration(description)  # node 6, whose default would be 186h
    assert (download.index, download.sub, download.data.hex()) == (0x1800, 1, "85010000")


@pytest.mark.parametrize("prologue", [BOMB, OUTSIDE], ids=["bomb", "outside"])
def test_a_document_type_is_refused(prologue: str) -> None:
    text = XDD.replace('encoding="utf-8"?>', f'encoding="utf-8"?>{prologue}').replace("Acme", "&a;")
    with pytest.raises(FileFaults, match="document type"):
        read_device(text.encode(), "test.xdd")


def test_of_a_broken_file_the_whole_part_is_read() -> None:
    broken = XDD[: XDD.index('<CANopenObject index="2000"')] + "<oops"
    description = read_device(broken.encode(), "test.xdd")
    assert [one.index for one in description.objects] == [0x1000, 0x1800]
    [finding] = description.findings
    assert finding.severity is FindingSeverity.ERROR
    assert "is not XML from here on" in str(finding.said)


def test_elements_within_elements_have_an_end() -> None:
    with pytest.raises(FileFaults, match="too many elements"):
        read_device(b"<a>" * 10_000, "test.xdd")
