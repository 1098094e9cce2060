"""Moves spheres for Turbid in several processes: linear springs and dashpots, plane walls. A template for engines in parallel.

Each process has the spheres of a slab across x. In each sub-step it gets copies of spheres that are near from the other processes; after
the step it hands over those that have left its slab, with their loads. The forces are those of spheres.py."""
import json
import math
import pathlib
import struct
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
import protocol

RECORD = struct.Struct("<Q21d")  # Id, mass, moment of inertia, radius, and three each of the fields below.
X, V, W, F, LOAD, TORQUE = range(4, 10)


def pack(sphere):
    return RECORD.pack(*sphere[:4], *sum(sphere[4:], []))


def unpack(records):
    return [[*n[:4], *(list(n[at:at + 3]) for at in range(4, 22, 3))] for n in RECORD.iter_unpack(records)]


class Spheres:
    hello = {"name": "parts.py 1", "shapes": ["sphere"], "walls": ["plane"], "contacts": True, "saves": True}

    def set_up(self, case, bodies):
        self.box, self.gravity, self.contact = case["box"], case["gravity"], case["contact"]
        self.walls, self.found, self.spheres = case["walls"], [], []
        grown = self.contact["enlargement"] if self.contact else 0.0
        kinds = [(t["mass"], t["inertia"][0], t["shape"]["radius"] + grown) for t in case["templates"]]
        self.reach = 2 * max(radius for _, _, radius in kinds)
        for id, kind, *n in bodies:
            self.spheres.append([id, *kinds[kind], list(n[:3]), list(n[7:10]), list(n[10:]), [0.0] * 3, [0.0] * 3, [0.0] * 3])
        if self.contact:  # One spring for all, as stiff as Hertz's law of the first material at an overlap of radius / 100.
            material, log_e = self.contact["materials"][0], math.log(self.contact["pairs"][0]["restitution"])
            smallest = min(radius for _, _, radius in kinds)
            self.k = material["youngs_modulus"] / (1 - material["poisson_ratio"] ** 2) * smallest / 21.2
            self.zeta = -log_e / math.sqrt(math.pi ** 2 + log_e ** 2)
        self.hand_over()

    def slab(self, x):
        """The part whose slab a place lies in."""
        return min(int(x % self.box["size"][0] / self.box["size"][0] * self.parts), self.parts - 1)

    def send(self, wanted):
        """Sends spheres to the parts that each of them is wanted by, and returns those that come."""
        if self.parts == 1:
            return []
        messages = {}
        for sphere in self.spheres:
            for part in {part for part in wanted(sphere) if part != self.part}:
                messages[part] = messages.get(part, b"") + pack(sphere)
        received = protocol.exchange(messages)
        return [sphere for part in sorted(received) for sphere in unpack(received[part])]

    def hand_over(self):
        """Gives the spheres that have left the slab to others."""
        come = self.send(lambda sphere: [self.slab(sphere[X][0])])
        self.spheres = sorted([s for s in self.spheres if self.slab(s[X][0]) == self.part] + come)

    def sum_forces(self):
        """Contacts of own spheres; each is one of the part that has the sphere with the lower id."""
        self.found, edges = [], [
            edge if periodic else math.inf for edge, periodic in zip(self.box["size"], self.box["periodic"])]
        width = self.box["size"][0] / self.parts
        near = lambda s: [self.slab(s[X][0] + d) for d in (*(n * width for n in range(int(self.reach / width) + 1)), self.reach)
                          for d in (d, -d)]
        ghosts = self.send(near)
        for s in self.spheres:
            s[F] = [0.0] * 3
        for n, a in enumerate(self.spheres if self.contact else []):
            for b in self.spheres[n + 1:] + ghosts:
                apart = [math.remainder(q - p, edge) for p, q, edge in zip(a[X], b[X], edges)]
                distance = math.hypot(*apart)
                if distance < a[3] + b[3]:
                    mass, normal = a[1] * b[1] / (a[1] + b[1]), [d / distance for d in apart]
                    force = self.push(a, a[3] + b[3] - distance, normal, b[V], mass)
                    b[F] = [p - f for p, f in zip(b[F], force)]  # Of a copy it is lost: its own part finds it, too.
                    if a[0] < b[0]:
                        self.found.append((a[0], b[0], *force))
            for k, wall in enumerate(self.walls):
                normal, point = wall["surface"]["normal"], wall["surface"]["point"]
                overlap = a[3] - sum((x - p) * m for x, p, m in zip(a[X], point, normal))
                if overlap > 0:
                    force = self.push(a, overlap, [-m for m in normal], wall["velocity"], a[1])
                    self.found.append((a[0], protocol.WALL - k, *force))

    def push(self, sphere, overlap, normal, velocity, mass):
        """Force of the contact with a body in the direction of the normal, of this velocity, on a sphere; adds it to the others."""
        approach = sum((p - q) * n for p, q, n in zip(sphere[V], velocity, normal))
        size = max(self.k * overlap + 2 * self.zeta * math.sqrt(self.k * mass) * approach, 0.0)
        sphere[F] = [p - size * n for p, n in zip(sphere[F], normal)]
        return [-size * n for n in normal]

    def advance(self, step, substeps, loads):
        for sphere, load in zip(self.spheres, loads):  # Both by ascending id.
            sphere[LOAD], sphere[TORQUE] = list(load[1:4]), list(load[4:])
        for _ in range(substeps):
            self.sum_forces()
            for _, mass, inertia, _, x, v, w, force, load, torque in self.spheres:
                for i in range(3):
                    v[i] += step * ((force[i] + load[i]) / mass + self.gravity[i])
                    w[i] += step * torque[i] / inertia
                    x[i] += step * v[i]
        self.hand_over()
        return self.particles()

    def particles(self):
        """The states, of several processes with the loads."""
        state = lambda s: (s[0], *s[X], 0, 0, 0, 1, *s[V], *s[W], *s[F], 0, 0, 0)
        return [state(s) + (tuple(s[LOAD] + s[TORQUE]) if self.parts > 1 else ()) for s in self.spheres]

    def contacts(self):
        return self.found

    def save(self):
        return json.dumps([self.spheres, self.found]).encode()

    def restore(self, saved):
        self.spheres, self.found = json.loads(saved)


protocol.serve(Spheres())
