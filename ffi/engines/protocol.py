"""The engine's end of Turbid's engine protocol (docs/engine-protocol.md), for engines in Python.

Import it before anything that prints: messages keep the standard output, and what is printed goes to the log.
"""
import json
import os
import struct

HELLO, SET_UP, READY, ADVANCE, STATES, LIST, CONTACTS, SAVE, SAVED, RESTORE, GOODBYE, ERROR, EXCHANGE, PARTICLES = range(1, 15)
WALL = 2 ** 64 - 1  # Less the index of a wall: stands for it in contacts.

_input = os.fdopen(os.dup(0), "rb")
_output = os.fdopen(os.dup(1), "wb")
os.dup2(2, 1)


class Refusal(Exception):
    """What the engine cannot do, in words for the user."""


def _send(kind, payload=b""):
    _output.write(struct.pack("<IIQ", kind, 0, len(payload)) + payload)
    _output.flush()


def _receive():
    head = _input.read(16)
    kind, _, length = struct.unpack("<IIQ", head) if len(head) == 16 else (GOODBYE, 0, 0)
    return kind, _input.read(length)


def exchange(messages):
    """Sends bytes to other processes of the engine, by their index, and returns what they sent here, likewise; all must call it."""
    pad = lambda message: message + bytes(-len(message) % 8)
    _send(EXCHANGE, b"".join(struct.pack("<QQ", part, len(message)) + pad(message) for part, message in messages.items()))
    kind, payload = _receive()
    if kind != EXCHANGE:
        raise SystemExit
    received, at = {}, 0
    while at < len(payload):
        part, length = struct.unpack_from("<QQ", payload, at)
        received[part], at = payload[at + 16:at + 16 + length], at + 16 + length + -length % 8
    return received


def _states(states):
    return STATES, b"".join(struct.pack(f"<Q{len(state) - 1}d", *state) for state in states)


def _answer(engine, kind, payload):
    if kind == HELLO:
        version, turbid = struct.unpack_from("<I", payload, 8)[0], json.loads(payload[16:])
        if version > 1 and not hasattr(engine, "particles"):
            raise Refusal("this engine has one process")
        engine.part, engine.parts = turbid.get("part", 0), turbid.get("parts", 1)
        return HELLO, struct.pack("<8sII", b"turbidEP", version, 0) + json.dumps(engine.hello).encode()
    if kind == SET_UP:
        length, = struct.unpack_from("<Q", payload)
        case, bodies = json.loads(payload[8:8 + length]), struct.iter_unpack("<QQ13d", payload[8 + length:])
        for key in ("rolling", "cohesion"):
            if (case["contact"] or {}).get(key, "none") not in ("none", *getattr(engine, "laws", {}).get(key, ())):
                raise Refusal(f"this engine has no contact.{key}")
        engine.set_up(case, list(bodies))
        return READY, b""
    if kind == ADVANCE:
        step, substeps = struct.unpack_from("<dQ", payload)
        return _states(engine.advance(step, substeps, list(struct.iter_unpack("<Q6d", payload[16:]))))
    if kind == PARTICLES:
        return _states(engine.particles())
    if kind == LIST:
        return CONTACTS, b"".join(struct.pack(f"<QQ{len(contact) - 2}d", *contact) for contact in engine.contacts())
    if kind == SAVE:
        return SAVED, engine.save()
    if kind == RESTORE:
        engine.restore(payload)
        return READY, b""
    raise Refusal(f"the message {kind} is not known")


def serve(engine):
    """Answers messages until Turbid says goodbye or ends.

    `engine` has `hello` and, for the messages of the same names, `set_up(case, bodies)`, `advance(step, substeps, loads)`,
    `contacts()`, `save()` and `restore(saved)`, of several processes `particles()`, too, and it gets the index `part` of its own and the
    number `parts` of all; `laws` may have the values of `rolling` and `cohesion` that it knows; records are tuples of numbers in the order of the protocol.
    """
    while True:
        kind, payload = _receive()
        if kind == GOODBYE:
            return
        try:
            _send(*_answer(engine, kind, payload))
        except Refusal as refusal:
            _send(ERROR, str(refusal).encode())
