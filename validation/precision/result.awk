# The table of result.md from result.csv: deviations from the reference, where it is zero the value itself, and what f16 changes.
NR > 1 {
    split($0, quoted, "\"")
    split(quoted[1], front, ",")
    split(quoted[3], value, ",")
    key = front[2] "|" quoted[2]
    if (!(key in place)) {
        place[key] = ++rows
        keys[rows] = key
    }
    measured[front[1], key] = value[2]
    reference[key] = value[3]
}
function shown(precision, key,    value) {
    value = measured[precision, key]
    if (reference[key] == "") return sprintf("%.7f", value)
    if (reference[key] == 0) return sprintf("%.1e", value)
    return sprintf("%+.2f %%", 100 * (value / reference[key] - 1))
}
END {
    command = "date -u +%Y-%m-%d"
    command | getline day
    printf "Made by `run.sh` on %s. Deviations from the reference; without one, the value.\n\n", day
    print "| case | quantity | f64 | f32 | f16 | f16 less f64 | |"
    print "|---|---|---|---|---|---|---|"
    for (row = 1; row <= rows; row++) {
        key = keys[row]
        split(key, name, "|")
        # Errors count as they are, other quantities relative to their values.
        scale = reference[key] == 0 && reference[key] != "" ? 1 : measured["f64", key]
        change = (measured["f16", key] - measured["f64", key]) / scale
        size = change < 0 ? -change : change
        verdict = size < 1e-3 ? "good" : size < 1e-2 ? "fair" : "poor"
        count[verdict]++
        printf "| %s | %s | %s | %s | %s | %+.3f %% | %s |\n", name[1], name[2], shown("f64", key), shown("f32", key), \
            shown("f16", key), 100 * change, verdict
    }
    printf "\n%d good (within 0.1 %%), %d fair (within 1 %%), %d poor.\n", count["good"], count["fair"], count["poor"]
}
