# result.md of result.csv: errors of the force by gap, lattice alone and with lubrication.
BEGIN { gaps = split("1 0.5 0.25 0.1", gap, " ") }
/^#/ || /^solids/ { next }
{
    key = $1 "," ($2 == "wall" ? "wall" : "pair") "," $3 "," $4 "," $5 "," ($7 == 1 ? "oblique" : "along an axis") "," $8
    if (!(key in seen)) { seen[key] = 1; order[++rows] = key }
    alone[key, $6] = $15; full[key, $6] = $16; force[key, $6] = $10; torque[key, $6] = $11
    more[key, $6] = $12; turn[key, $6] = $13
    if ($16 != "") {
        error = $16 + 0
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
    for (r = 1; r <= rows; r++) {
        split(order[r], part, ",")
        if (full[order[r], gap[1]] == "") continue
        line = "|"
        for (i = 1; i <= 7; i++) line = line " " part[i] " |"
        for (g = 1; g <= gaps; g++) line = line " " full[order[r], gap[g]] " (" alone[order[r], gap[g]] ") |"
        print line
    }
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
        split(order[r], part, ",")
        if (full[order[r], gap[1]] != "") continue
        head = "|"
        for (i = 1; i <= 7; i++) head = head " " part[i] " |"
        line = head " force |"
        for (g = 1; g <= gaps; g++) line = line " " more[order[r], gap[g]] " (" force[order[r], gap[g]] ") |"
        print line
        line = head " torque |"
        for (g = 1; g <= gaps; g++) line = line " " turn[order[r], gap[g]] " (" torque[order[r], gap[g]] ") |"
        print line
    }
}
