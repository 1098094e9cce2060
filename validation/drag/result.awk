# result.csv to the tables of result.md: a row for each set of operators, body, resolution and volume fraction; errors of the places
# in a cell side by side under each relaxation time.
/^#/ || /^solids/ { next }
$10 < 1 && $6 != "sphere" && $6 != "cube" {
    error = $11
    sub(/ %$/, "", error)
    if ($4 == 32) limit[$6, $7] = 1 + error / 100
    else {
        key = $1 SUBSEP $6 SUBSEP $7
        if (!(key in known)) { known[key] = 1; other[++others] = key }
        factor[key, $3, $4] = 1 + error / 100
    }
}
$10 < 1 && ($6 == "sphere" || $6 == "cube") {
    operators = $1 == "paper" ? "`paper`" : $1 == "sc3" && $2 == 0.125 ? "`saturated`" : $1 ", magic parameter " $2
    way = $9 == 0 ? "held" : "moving"
    turned = $6 == "cube" ? ($7 == 0 ? "along the lattice | " : "turned | ") : ""
    key = operators " | " $4 " | " $5 " | " turned way
    if (!((key, $6) in seen)) { seen[key, $6] = 1; list[$6, ++count[$6]] = key }
    error = $11
    sub(/ %$/, "", error)
    value[key, $6, $3] = value[key, $6, $3] (value[key, $6, $3] == "" ? "" : ", ") error
    if (operators == "`saturated`" && $4 >= 12) {
        size = error < 0 ? -error : error + 0
        if (size > worst[$6]) worst[$6] = size
        if (!($6 in least) || error + 0 < least[$6]) least[$6] = error + 0
        if (!($6 in most) || error + 0 > most[$6]) most[$6] = error + 0
        number[$6]++
        if (size <= ($6 == "cube" ? 4 : 2)) within[$6]++
        if (way == "moving" && $13 > noise[$6]) noise[$6] = $13 + 0
        off = $12 > 1 ? $12 - 1 : 1 - $12
        if (off > unbalanced[$6]) unbalanced[$6] = off
    }
}
$10 >= 1 {
    error = $11
    sub(/ %$/, "", error)
    fast[++fasts] = sprintf("| %s | %s | %s | %s | %s | %.4f | %.4f | %.2f %% |", $1 == "paper" ? "`paper`" : "`saturated`", $4, $10, $3, $9, 1 + error / 100, $12, 100 * $13)
    if ($1 == "sc3" && $4 >= 12 && $13 > noise[$6]) noise[$6] = $13 + 0
}
function table(shape, head,    k, t, line) {
    print head " tau 0.53 | 0.55 | 0.65 | 0.8 | 1.0 |"
    print rule(head "|||||")
    for (k = 1; k <= count[shape]; k++) {
        line = "| " list[shape, k] " |"
        for (t = 1; t <= 5; t++) line = line " " value[list[shape, k], shape, tau[t]] " |"
        gsub(/ +\|/, " |", line)
        print line
    }
    print ""
}
function rule(text,    n, bars) {
    n = gsub(/\|/, "|", text)
    bars = "|"
    while (--n > 0) bars = bars "---|"
    return bars
}
END {
    split("0.53 0.55 0.65 0.8 1.0", tau, " ")
    command = "date -u +%Y-%m-%d"
    command | getline day
    printf "Made by `run.sh` on %s. Errors of the drag in per cent; two numbers are of two places in a cell.\n\n", day
    print "| `saturated`, 12 cells and more | cases | from | to | aim | within it |"
    print "|---|---|---|---|---|---|"
    printf "| spheres | %d | %+.2f %% | %+.2f %% | 2 %% | %d |\n", number["sphere"], least["sphere"], most["sphere"], within["sphere"]
    printf "| cubes | %d | %+.2f %% | %+.2f %% | 4 %% | %d |\n\n", number["cube"], least["cube"], most["cube"], within["cube"]
    printf "Largest noise of the force on a moving sphere: %.2f %% of its mean (1 %% wanted); on a cube: %.2f %%.", 100 * noise["sphere"], 100 * noise["cube"]
    printf " Force over momentum fed in: within %.1e of 1 (spheres), %.1e (cubes).\n\n", unbalanced["sphere"], unbalanced["cube"]
    print "## Spheres\n"
    table("sphere", "| operators | cells | volume fraction | |")
    print "## Cubes\n"
    table("cube", "| operators | cells | volume fraction | placed | |")
    print "## Other bodies\n"
    print "Volume fraction 0.064, two poses; deviation from the drag of the same with 32 cells, relaxation time 1, `saturated`.\n"
    print "| operators | body | pose | drag over that of the sphere of equal volume | 12 cells, tau 0.55 | 1.0 | 20 cells, tau 0.55 | 1.0 |"
    print "|---|---|---|---|---|---|---|---|"
    for (k = 1; k <= others; k++) {
        split(other[k], part, SUBSEP)
        if (!((part[2], part[3]) in limit)) continue
        line = sprintf("| %s | %s | %s | %.4f |", part[1] == "paper" ? "`paper`" : "`saturated`", part[2], part[3], limit[part[2], part[3]])
        for (c = 1; c <= 2; c++) for (t = 2; t <= 5; t += 3) {
            cells = c == 1 ? 12 : 20
            off = 100 * (factor[other[k], tau[t], cells] / limit[part[2], part[3]] - 1)
            line = line sprintf(" %+.2f |", off)
            column = part[1] SUBSEP cells
            sum[column] += off
            terms[column]++
            if (off < 0) off = -off
            if (off > largest[column]) largest[column] = off
        }
        print line
    }
    print ""
    for (k = 1; k <= 4; k++) {
        operators = k < 3 ? "sc3" : "paper"
        cells = k % 2 ? 12 : 20
        column = operators SUBSEP cells
        if (terms[column]) printf "%s, %d cells: %+.2f %% in the mean, %.2f %% at most.\n", operators == "sc3" ? "`saturated`" : "`paper`", cells, sum[column] / terms[column], largest[column]
    }
    print ""
    print "## Moving through the lattice, with inertia\n"
    print "Drag over that of the array in Stokes flow: only differences count.\n"
    print "| operators | cells | Re | tau | speed, cells per step | drag | force over momentum fed in | noise |"
    print "|---|---|---|---|---|---|---|---|"
    for (k = 1; k <= fasts; k++) print fast[k]
}
