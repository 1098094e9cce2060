"""Moves spheres for Turbid: linear springs and dashpots, plane walls, gravity. A template for engines of your own.

It speaks the engine protocol (docs/engine-protocol.md) on its standard input and output; all numbers are in SI units."""
import json
import math
import struct
import sys

HELLO, SET_UP, READY, ADVANCE, STATES, LIST, CONTACTS, SAVE, SAVED, RESTORE, GOODBYE, ERROR = range(1, 13)
ABLE = {"name": "spheres.py 1", "shapes": ["sphere"], "walls": ["plane"], "contacts": True, "saves": True}


def send(kind, payload=b""):
    sys.stdout.buffer.write(struct.pack("<IIQ", kind, 0, len(payload)) + payload)
    sys.stdout.buffer.flush()


def receive():
    head = sys.stdin.buffer.read(16)
    kind, _, length = struct.unpack("<IIQ", head) if len(head) == 16 else (GOODBYE, 0, 0)  # Turbid has ended.
    return kind, sys.stdin.buffer.read(length)


def set_up(payload):
    """The case and its particles: [id, mass, inertia, radius, x[3], v[3], w[3], force[3], torque[3]]."""
    length, = struct.unpack_from("<Q", payload)
    case, spheres = json.loads(payload[8:8 + length]), []
    contact = case["contact"]
    for id, kind, *n in struct.iter_unpack("<QQ13d", payload[8 + length:]):
        body = case["templates"][kind]
        radius = body["shape"]["radius"] + (contact["enlargement"] if contact else 0.0)
        spheres.append([id, body["mass"], body["inertia"][0], radius, n[:3], n[7:10], n[10:], [0.0] * 3, [0.0] * 3])
    if contact:  # One spring for all, as stiff as Hertz's law of the first material at an overlap of radius / 100.
        material, log_e = contact["materials"][0], math.log(contact["pairs"][0]["restitution"])
        case["k"] = material["youngs_modulus"] / (1 - material["poisson_ratio"] ** 2) * min(s[3] for s in spheres) / 21.2
        case["zeta"] = -log_e / math.sqrt(math.pi ** 2 + log_e ** 2)
    return case, spheres


def contacts(case, spheres):
    """Normal forces on the first of each pair, as (first, second, force[3]); also sums those on each sphere."""
    found, box = [], zip(case["box"]["size"], case["box"]["periodic"])
    edges = [edge if periodic else math.inf for edge, periodic in box]
    for s in spheres:
        s[7] = [0.0] * 3
    for n, a in enumerate(spheres if case["contact"] else []):
        for b in spheres[n + 1:]:  # Every pair: take a cell list for more than some hundred spheres.
            apart = [math.remainder(q - p, edge) for p, q, edge in zip(a[4], b[4], edges)]  # The nearest image.
            distance = math.hypot(*apart)
            if distance < a[3] + b[3]:
                mass, normal = a[1] * b[1] / (a[1] + b[1]), [d / distance for d in apart]
                found.append(push(case, a, b[0], a[3] + b[3] - distance, normal, b[5], mass))
                b[7] = [p - f for p, f in zip(b[7], found[-1][2:])]
        for k, wall in enumerate(case["walls"]):
            normal, point = wall["surface"]["normal"], wall["surface"]["point"]
            overlap = a[3] - sum((x - p) * m for x, p, m in zip(a[4], point, normal))
            if overlap > 0:
                found.append(push(case, a, 2 ** 64 - 1 - k, overlap, [-m for m in normal], wall["velocity"], a[1]))
    return found


def push(case, sphere, other, overlap, normal, velocity, mass):
    """The contact of a sphere with a body in the direction of the normal, of this velocity; adds its force."""
    approach = sum((p - q) * n for p, q, n in zip(sphere[5], velocity, normal))
    size = max(case["k"] * overlap + 2 * case["zeta"] * math.sqrt(case["k"] * mass) * approach, 0.0)
    sphere[7] = [p - size * n for p, n in zip(sphere[7], normal)]
    return (sphere[0], other, *(-size * n for n in normal))


def advance(case, spheres, payload):
    """Leapfrog: kick, drift, by sub-steps under constant loads; returns the contacts of the last one."""
    step, substeps = struct.unpack_from("<dQ", payload)
    for _ in range(substeps):
        found = contacts(case, spheres)
        for (_, mass, inertia, _, x, v, w, force, _), load in zip(spheres, struct.iter_unpack("<Q6d", payload[16:])):
            for i in range(3):
                v[i] += step * ((force[i] + load[1 + i]) / mass + case["gravity"][i])
                w[i] += step * load[4 + i] / inertia
                x[i] += step * v[i]
    return found


for kind, payload in iter(receive, (GOODBYE, b"")):
    if kind == HELLO:
        send(HELLO, struct.pack("<8sII", b"turbidEP", 1, 0) + json.dumps(ABLE).encode())
    elif kind == SET_UP:
        (case, spheres), found = set_up(payload), []
        lacks = [key for key in ("rolling", "cohesion") if (case["contact"] or {}).get(key, "none") != "none"]
        send(ERROR, f"this engine has no contact.{lacks[0]}".encode()) if lacks else send(READY)
    elif kind == ADVANCE:
        found = advance(case, spheres, payload)
        send(STATES, b"".join(struct.pack("<Q19d", s[0], *s[4], 0, 0, 0, 1, *sum(s[5:], [])) for s in spheres))
    elif kind == LIST:
        send(CONTACTS, b"".join(struct.pack("<QQ3d", *contact) for contact in found))
    elif kind == SAVE:  # With what the set-up does not bring: positions that are not wrapped, and the contacts.
        send(SAVED, json.dumps([spheres, found]).encode())
    elif kind == RESTORE:
        spheres, found = json.loads(payload)
        send(READY)
    else:
        send(ERROR, f"the message {kind} is not known".encode())
