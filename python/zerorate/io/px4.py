"""stub"""

from zerorate.io.table import Format

FORMAT = Format("ulog", "a ULog", (".ulg",), (b"ULog\x01\x12\x35",), None)
