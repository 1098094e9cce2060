# cost.csv to cost.md: what each part of a step costs, and what follows for many ranks.
function log2_up(n,    k) { for (k = 0; 2 ^ k < n; k++); return k }
function least(a, b) { return a < b ? a : b }
function most(a, b) { return a > b ? a : b }

# Least squares of the sweep over the number of cells of a rank (two ranks share the box).
$1 == "cells" && $2 != "edge" { x = $3 / 2; n++; sx += x; sy += $4; sxx += x * x; sxy += x * $4; each = each sprintf("%s%.2f", n > 1 ? ", " : "", 1e9 * $4 / x) }
$1 == "free" { free_cells = $2 / 2; covered = $3 / 2; map = $4; sweep = $5 }
$1 == "sphere" { spheres = $2; touching = $3; with = $4; without = $5 }
$1 == "polyhedron" { few = $3; time_few = $4; many = $5; time_many = $6 }
$1 == "network" { per_message = $2; per_byte = $3; per_reduction = $4 }

# Seconds per step of a rank with a cubic block of `s` cells, one of `ranks`; sets the share of what is not its own work.
function step(s, ranks,    own, known, contacts, peers, messages, bytes, work, extra) {
    own = phi * s ^ 3 / volume
    known = phi * (s + 2 * reach) ^ 3 / volume
    contacts = per_sphere * own
    work = a * s ^ 3 + b * coverage * phi * s ^ 3 + c * own + d * contacts
    if (ranks == 1) return work
    # Faces and edges; and four messages to all blocks within reach.
    peers = least(ranks - 1, (2 * int((reach + s - 1) / s) + 1) ^ 3 - 1)
    messages = 18 + 4 * peers
    bytes = 4 * (30 * s ^ 2 - 12 * s) + (240 + 56) * (known - own) + 64 * contacts * least(1, 3 * diameter / s)
    extra = c * (known - own) + messages * latency + bytes / bandwidth + 1 / 8 * log2_up(ranks) * latency
    return work + extra
}
END {
    a = (n * sxy - sx * sy) / (n * sxx - sx * sx)
    b = (map + sweep - a * free_cells) / covered
    c = without / spheres
    d = touching > 0 ? most(0, (with - without) / touching) : 0
    polyhedron = many > few ? (time_many - time_few) / (many - few) : 0
    printf "Made by `run.sh` with %s on two cores.\n\n", version
    print "| what | cost | how measured |"
    print "|---|---|---|"
    printf "| a cell | %.2f ns | least squares over 4, 6 and 8 D without particles, 2 threads; per cell %s ns |\n", 1e9 * a, each
    printf "| a covered cell, more | %.2f ns | the same with particles that do not touch: mapping, solid, momentum exchange |\n", 1e9 * b
    printf "| a sphere | %.2f us | engine without contacts, 1 rank |\n", 1e6 * c
    printf "| a contact of spheres | %.2f us | engine with %d contacts less that without, 1 rank |\n", 1e6 * d, touching
    printf "| a contact of polyhedra | %.2f us | dry box with %d and with %d contacts, 1 rank |\n", 1e6 * polyhedron, few, many
    printf "| a message | %.2f us | two MPI processes, there and back at once |\n", 1e6 * per_message
    printf "| a byte | %.3f ns | the same, 1 MiB; packed and unpacked |\n", 1e9 * per_byte
    printf "| a reduction | %.2f us | the same, 13 integers |\n", 1e6 * per_reduction
    # Spheres of 18 cells at a volume fraction of 0.3.
    diameter = 18; phi = 0.3; reach = diameter + 2; volume = 3.14159265 / 6 * diameter ^ 3
    coverage = covered / (phi * free_cells); per_sphere = touching / spheres
    latency = 1.5e-6; bandwidth = 10e9
    print "\nPredicted, weak: cells per rank stay.\n"
    print "| ranks | 6 D per rank, ms | efficiency | 3 D per rank, ms | efficiency |"
    print "|---|---|---|---|---|"
    for (k = 0; k <= 5; k++) {
        ranks = 10 ^ k
        printf "| %d | %.2f | %.3f | %.3f | %.3f |\n", ranks, 1e3 * step(108, ranks), step(108, 1) / step(108, ranks), \
            1e3 * step(54, ranks), step(54, 1) / step(54, ranks)
    }
    print "\nPredicted, strong: a box of 120 D (10^10 cells, 990 000 spheres) stays.\n"
    print "| ranks | cells along an edge of a block | step, ms | efficiency |"
    print "|---|---|---|---|"
    total = 2160 ^ 3
    for (k = 2; k <= 5; k++) {
        ranks = 10 ^ k
        s = (total / ranks) ^ (1 / 3)
        printf "| %d | %.0f | %.2f | %.3f |\n", ranks, s, 1e3 * step(s, ranks), step(2160, 1) / ranks / step(s, ranks)
    }
}
