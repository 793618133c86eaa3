"""Packets of devices: bytes from a serial line, a socket or Bluetooth become rows of samples.

A protocol is a module with a decoder and the names of its columns, with sensors and units. All
other code treats its rows like lines of text. To add a protocol, write a module and add it to
`PACKETS`.
"""

from zerorate.io.packets import phone, witmotion, xio, xsens
from zerorate.io.packets.protocol import Damage, Decoder, PacketProtocol, Row

__all__ = ["PACKETS", "Damage", "Decoder", "PacketProtocol", "Row"]

PACKETS: dict[str, PacketProtocol] = {
    form.name: form for form in (phone.PROTOCOL, witmotion.PROTOCOL, xio.PROTOCOL, xsens.PROTOCOL)
}
"""Protocols by name."""
