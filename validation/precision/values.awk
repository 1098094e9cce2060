# Rows of validation.csv with a reference, for run.sh.
NR > 1 {
    # The second field is quoted where it has commas.
    name = $0
    sub(/,.*/, "", name)
    rest = substr($0, length(name) + 2)
    if (rest ~ /^"/) {
        rest = substr(rest, 2)
        at = index(rest, "\"")
        quantity = substr(rest, 1, at - 1)
        rest = substr(rest, at + 2)
    } else {
        at = index(rest, ",")
        quantity = substr(rest, 1, at - 1)
        rest = substr(rest, at + 1)
    }
    split(rest, value, ",")
    # A precision that the case sets itself gives way.
    gsub(/, f(32|64)/, "", quantity)
    if (value[2] != "" && !seen[name, quantity]++)
        printf "%s,%s,\"%s\",%s,%s\n", precision, name, quantity, value[1], value[2]
}
