"""Packets that devices send: bytes of a serial line, a socket or Bluetooth as rows of samples.

A protocol is a file with a decoder and the names of its columns, which show sensors and units; all
else takes its rows as lines of text. To add one, write such a file and name it in `PACKETS`.
"""

from zerorate.io.packets import phone, witmotion, xio, xsens
from zerorate.io.packets.protocol import Damage, Decoder, PacketProtocol, Row

__all__ = ["PACKETS", "Damage", "Decoder", "PacketProtocol", "Row"]

PACKETS: dict[str, PacketProtocol] = {
    form.name: form for form in (phone.PROTOCOL, witmotion.PROTOCOL, xio.PROTOCOL, xsens.PROTOCOL)
}
"""The forms by their names."""
