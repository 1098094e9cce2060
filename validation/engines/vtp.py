"""Reads arrays of Turbid's .vtp files: base64 of blocks that LZ4 has compressed."""
import math
import struct
from array import array
from base64 import b64decode
from xml.etree import ElementTree

TYPES = {"Float32": "f", "Float64": "d", "Int64": "q", "UInt64": "Q", "UInt32": "I"}


def lz4(data):
    """One block of LZ4, unpacked."""
    out, at = bytearray(), 0

    def length(nibble):
        nonlocal at
        total = nibble
        while nibble == 15 or nibble == 255:
            nibble, at = data[at], at + 1
            total += nibble
        return total

    while at < len(data):
        token, at = data[at], at + 1
        literals = length(token >> 4)
        out += data[at:at + literals]
        at += literals
        if at < len(data):
            back, at = data[at] | data[at + 1] << 8, at + 2
            for _ in range(length(token & 15) + 4):
                out.append(out[-back])
    return bytes(out)


def read(path):
    """Lists of numbers by the names of the arrays; none of a file without points."""
    arrays = {}
    for element in ElementTree.parse(path).getroot().iter("DataArray"):
        text = (element.text or "").strip()
        blocks = struct.unpack("<Q", b64decode(text[:12])[:8])[0] if text else 0
        if not blocks or element.get("Name") in arrays:
            continue
        head = 4 * math.ceil(8 * (3 + blocks) / 3)
        sizes = struct.unpack(f"<{3 + blocks}Q", b64decode(text[:head]))[3:]
        data, values = b64decode(text[head:]), array(TYPES[element.get("type")])
        for size in sizes:
            values.frombytes(lz4(data[:size]))
            data = data[size:]
        arrays[element.get("Name")] = list(values)
    return arrays
