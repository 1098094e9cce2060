# result.md of result.csv: errors of the force by gap, lattice alone and with lubrication.
# A row of a table: its key, a column more if there is one, and by the gap the values of both, that of the lattice in brackets.
function row(key, more, with, lattice,    part, line, i, g) {
    split(key, part, ",")
    line = "|"
    for (i = 1; i <= 7; i++) line = line " " part[i] " |"
    if (more != "") line = line " " more " |"
    for (g = 1; g <= gaps; g++) line = line " " with[key, gap[g]] " (" lattice[key, gap[g]] ") |"
    print line
}
BEGIN { gaps = split("1 0.5 0.25 0.1", gap, " ") }
/^#/ || /^solids/ { next }
$10 != 1 {
    key = $1 " | " ($2 == "wall" ? "wall" : "pair") " | " $10 " | " $11 " | " $4 " | " $5 " | " $9
    if (!(key in met)) { met[key] = 1; bodies[++spheroids] = key }
    n = ++values[key]
    width[key, n] = $6; own[key, n] = $12; all[key, n] = $14; turned[key, n] = $15; alike[key, n] = $16
    next
}
{
    key = $1 "," ($2 == "wall" ? "wall" : "pair") "," $3 "," $4 "," $5 "," ($7 == 1 ? "oblique" : "along an axis") "," $8
    if (!(key in seen)) { seen[key] = 1; order[++rows] = key }
    alone[key, $6] = $17; full[key, $6] = $18; force[key, $6] = $12; torque[key, $6] = $13
    more[key, $6] = $14; turn[key, $6] = $15
    if ($18 != "") {
        error = $18 + 0
        group = $1 " " ($2 == "wall" ? "wall" : "pair") " " $3
        if (!(group in count)) groups[++many] = group
        count[group]++; sum[group] += error
        if (error * error > worst[group] * worst[group]) worst[group] = error
    }
}
END {
    print "Made by `run.sh`. Errors of the force on a sphere, with lubrication (of the lattice alone), by the gap in cells."
    print ""
    print "| coupling | with | motion | tau | N | line of centres | place | 1 | 0.5 | 0.25 | 0.1 |"
    print "|---|---|---|---|---|---|---|---|---|---|---|"
    for (r = 1; r <= rows; r++)
        if (full[order[r], gap[1]] != "") row(order[r], "", full, alone)
    print ""
    print "| group | rows times gaps | mean error | largest |"
    print "|---|---|---|---|"
    for (k = 1; k <= many; k++)
        printf "| %s | %d | %+.1f %% | %+.1f %% |\n", groups[k], count[groups[k]], sum[groups[k]] / count[groups[k]], worst[groups[k]]
    print ""
    print "Force over 6 pi mu a U, torque over 8 pi mu a^2 U, with lubrication (of the lattice alone), where there is no exact value here."
    print ""
    print "| coupling | with | motion | tau | N | line of centres | place | quantity | 1 | 0.5 | 0.25 | 0.1 |"
    print "|---|---|---|---|---|---|---|---|---|---|---|---|"
    for (r = 1; r <= rows; r++) {
        if (full[order[r], gap[1]] != "") continue
        row(order[r], "force", more, force)
        row(order[r], "torque", turn, torque)
    }
    print ""
    print "Spheroids that are squeezed: force over 6 pi mu a U, torque over 8 pi mu a^2 U, a of the sphere of equal volume. Rise: of the force since the gap"
    print "before, over that of spheres with the same reduced radius (exact)."
    print ""
    print "| coupling | with | polar over equatorial | tilt | tau | N | room | gap | force (lattice) | torque | rise |"
    print "|---|---|---|---|---|---|---|---|---|---|---|"
    for (r = 1; r <= spheroids; r++) {
        key = bodies[r]
        for (k = 1; k <= values[key]; k++) {
            rise = k == 1 ? "" : sprintf("%.3f", (all[key, k] - all[key, k - 1]) / (alike[key, k] - alike[key, k - 1]))
            printf "| %s | %s | %.3f (%.3f) | %.3f | %s |\n", key, width[key, k], all[key, k], own[key, k], turned[key, k], rise
        }
    }
}
