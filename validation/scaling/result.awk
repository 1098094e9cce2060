# result.csv to the tables of result.md; with median.awk before it.
/^#/ || /^case/ { next }
$1 == "L 6 D" && $3 != "crowded" {
    key = $2 " " $3
    count[key]++
    speed[key, count[key]] = $5
    stream[key, count[key]] = $6
    contacts = $7
    messages[key] = $8
    bytes[key] = $9
    halo[key] = halo[key] " " 1e3 * $11
    exchange[key] = exchange[key] " " 1e3 * $12
}
$1 == "L 6 D" && $3 == "crowded" {
    crowded = crowded sprintf("| %d processes | %.1f | %.1f | %.0f | %.1f |\n", $2, $5, $8, $9 / 1e3, $10 / 1e6)
}
$1 == "L 12 D" { memory[$2] = $10; large = $4 }
function all(figure, key,    k, list) {
    for (k = 1; k <= count[key]; k++) list = list " " figure[key, k]
    return list
}
function ratio(figure, key, to,    k, list) {
    for (k = 1; k <= count[key]; k++) list = list " " figure[key, k] / figure[to, k]
    return list
}
function extremes(list,    values, n, k, least, most) {
    n = split(list, values, " ")
    least = most = values[1]
    for (k = 2; k <= n; k++) {
        if (values[k] + 0 < least + 0) least = values[k]
        if (values[k] + 0 > most + 0) most = values[k]
    }
    return sprintf("%.3f to %.3f", least, most)
}
END {
    one = "1 threads"; two = "2 threads"; mpi = "2 mpi"
    name[one] = "1 rank"; name[two] = "2 threads"; name[mpi] = "2 MPI processes"
    command = "date -u +%Y-%m-%d"
    command | getline day
    printf "Made by `run.sh` on %s with %s; %d cores, %d rounds, L = 6 D: 1 259 712 cells, %d contacts.\n\n", day, version, cores, rounds, contacts
    print "| ranks | MLUPS | streaming, GB/s | messages per step | kB per step | in halo calls, ms | in exchanges, ms |"
    print "|---|---|---|---|---|---|---|"
    split(one "," two "," mpi, keys, ",")
    for (k = 1; k <= 3; k++) {
        key = keys[k]
        printf "| %s | %.1f | %.1f | %.1f | %.1f | %.2f | %.2f |\n", name[key], median(all(speed, key)), \
            median(all(stream, key)), messages[key], bytes[key] / 1e3, median(halo[key]), median(exchange[key])
    }
    print "\nMedians; times are means over the ranks, per step. Ratios are taken round by round:\n"
    print "| ratio | median | over the rounds | of the streaming bandwidth | wanted |"
    print "|---|---|---|---|---|"
    printf "| 2 threads over 1 rank | %.3f | %s | %.3f | 1.8 where the bandwidth allows |\n", median(ratio(speed, two, one)), \
        extremes(ratio(speed, two, one)), median(ratio(stream, two, one))
    printf "| 2 MPI processes over 2 threads | %.3f | %s | %.3f | 0.95 |\n", median(ratio(speed, mpi, two)), \
        extremes(ratio(speed, mpi, two)), median(ratio(stream, mpi, two))
    print "\nMore processes than cores end, too:\n"
    print "| ranks | MLUPS | messages per step | kB per step | memory per rank, MB |"
    print "|---|---|---|---|---|"
    printf "%s", crowded
    if (8 in memory) {
        allowed = 1.3 / 8 * memory[1] + 60e6
        printf "\nMemory at L = 12 D (%d cells): %.0f MB on 1 rank, %.0f MB in each of 8 MPI processes; ", large, memory[1] / 1e6, memory[8] / 1e6
        printf "allowed are 1.3 / 8 of the one plus 60 MB, %.0f MB.\n", allowed / 1e6
        if (memory[8] > allowed) print "**More than allowed.**"
    }
}
