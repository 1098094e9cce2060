"""Moves spheres for Turbid: linear springs and dashpots, plane walls, gravity. A template for engines of your own.

It speaks the engine protocol (docs/engine-protocol.md) on its standard input and output; all numbers are in SI units.
"""
import json
import math
import struct
import sys

HELLO, SET_UP, READY, ADVANCE, STATES, LIST, CONTACTS, SAVE, SAVED, RESTORE, GOODBYE, ERROR = range(1, 13)


def send(kind, payload=b""):
    sys.stdout.buffer.write(struct.pack("<IIQ", kind, 0, len(payload)) + payload)
    sys.stdout.buffer.flush()


def receive():
    head = sys.stdin.buffer.read(16)
    if len(head) < 16:
        return GOODBYE, b""  # Turbid has ended.
    kind, _, length = struct.unpack("<IIQ", head)
    return kind, sys.stdin.buffer.read(length)


def set_up(payload):
    """The case and its particles: [id, mass, inertia, radius, x[3], v[3], w[3], force[3], torque[3]]."""
    length, = struct.unpack_from("<Q", payload)
    case = json.loads(payload[8:8 + length])
    spheres = []
    for id, kind, *numbers in struct.iter_unpack("<QQ13d", payload[8 + length:]):
        body = case["templates"][kind]
        radius = body["shape"]["radius"] + (case["contact"] or {"enlargement": 0.0})["enlargement"]
        x, v, w = numbers[0:3], numbers[7:10], numbers[10:13]
        spheres.append([id, body["mass"], body["inertia"][0], radius, x, v, w, [0.0] * 3, [0.0] * 3])
    # One spring for all pairs, as stiff as Hertz's law of the first material at an overlap of a hundredth of a radius.
    if case["contact"]:
        material, pair = case["contact"]["materials"][0], case["contact"]["pairs"][0]
        radius = min(s[3] for s in spheres)
        case["k"] = material["youngs_modulus"] / (1 - material["poisson_ratio"] ** 2) * radius / 21.2
        log_e = math.log(pair["restitution"])
        case["zeta"] = -log_e / math.sqrt(math.pi ** 2 + log_e ** 2)
    return case, spheres


def contacts(case, spheres):
    """Normal forces on the first of each pair, as (first, second, force[3]); also adds them to the force of each sphere."""
    found, edges = [], case["box"]["size"]
    for s in spheres:
        s[7] = [0.0] * 3
    if not case["contact"]:
        return found
    for n, a in enumerate(spheres):
        for b in spheres[n + 1:]:  # Every pair: take a cell list for more than some hundred spheres.
            apart = [q - p for p, q in zip(a[4], b[4])]
            for i in range(3):
                if case["box"]["periodic"][i]:
                    apart[i] -= edges[i] * round(apart[i] / edges[i])
            distance = math.sqrt(sum(d * d for d in apart))
            if distance < a[3] + b[3]:
                normal = [d / distance for d in apart]
                force = push(case, a[3] + b[3] - distance, normal, a[5], b[5], a[1] * b[1] / (a[1] + b[1]))
                a[7], b[7] = [p + f for p, f in zip(a[7], force)], [p - f for p, f in zip(b[7], force)]
                found.append((a[0], b[0], *force))
        for n, wall in enumerate(case["walls"]):
            normal, point = wall["surface"]["normal"], wall["surface"]["point"]
            overlap = a[3] - sum((x - p) * m for x, p, m in zip(a[4], point, normal))
            if overlap > 0:
                force = push(case, overlap, [-m for m in normal], a[5], wall["velocity"], a[1])
                a[7] = [p + f for p, f in zip(a[7], force)]
                found.append((a[0], 2 ** 64 - 1 - n, *force))
    return found


def push(case, overlap, normal, v, other, mass):
    approach = sum((p - q) * n for p, q, n in zip(v, other, normal))
    force = case["k"] * overlap + 2 * case["zeta"] * math.sqrt(case["k"] * mass) * approach
    return [-max(force, 0.0) * n for n in normal]


def advance(case, spheres, payload):
    """Leapfrog: kick, drift, by sub-steps under constant loads; returns the contacts of the last one."""
    step, substeps = struct.unpack_from("<dQ", payload)
    loads = [load[1:] for load in struct.iter_unpack("<Q6d", payload[16:])]
    for _ in range(substeps):
        found = contacts(case, spheres)
        for (_, mass, inertia, _, x, v, w, force, _), load in zip(spheres, loads):
            for i in range(3):
                v[i] += step * ((force[i] + load[i]) / mass + case["gravity"][i])
                w[i] += step * load[3 + i] / inertia
                x[i] += step * v[i]
    return found


def main():
    case, spheres, found = None, [], []
    while True:
        kind, payload = receive()
        if kind == HELLO:
            words = {"name": "spheres.py 1", "shapes": ["sphere"], "walls": ["plane"], "contacts": True, "saves": True}
            send(HELLO, struct.pack("<8sII", b"turbidEP", 1, 0) + json.dumps(words).encode())
        elif kind == SET_UP:
            case, spheres = set_up(payload)
            send(READY)
        elif kind == ADVANCE:
            found = advance(case, spheres, payload)
            state = lambda s: struct.pack("<Q19d", s[0], *s[4], 0, 0, 0, 1, *s[5], *s[6], *s[7], *s[8])
            send(STATES, b"".join(map(state, spheres)))
        elif kind == LIST:
            send(CONTACTS, b"".join(struct.pack("<QQ3d", *contact) for contact in found))
        elif kind == SAVE:  # What the set-up does not bring: positions that are not wrapped, and the contacts.
            send(SAVED, json.dumps([[s[4:] for s in spheres], found]).encode())
        elif kind == RESTORE:
            states, found = json.loads(payload)
            for sphere, state in zip(spheres, states):
                sphere[4:] = state
            send(READY)
        elif kind == GOODBYE:
            return
        else:
            send(ERROR, f"the message {kind} is not known".encode())


main()
