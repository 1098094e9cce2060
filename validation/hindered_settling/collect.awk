# One line of result.csv from reference.csv, series.csv and summary.json, in this order.
#   awk -f collect.awk -v phi=0.1 -v balance=mixture reference.csv series.csv summary.json

# Reynolds number of one sphere, Re (1 + 0.15 Re^0.687) = Ar / 18 (Schiller and Naumann 1933).
function reynolds(ar,    low, high, middle, i) {
    low = 0; high = ar / 18
    for (i = 0; i < 200; i++) {
        middle = (low + high) / 2
        if (middle * (1 + 0.15 * middle ^ 0.687) > ar / 18) high = middle; else low = middle
    }
    return low
}

# Velocity over nu / D: k (1 - phi)^n Re, n of Garside and Al-Dibouni (1977), k of Yao et al. (2021).
function correlation(ar, phi,    re, ratio) {
    re = reynolds(ar)
    ratio = 0.1 * re ^ 0.9
    return 0.89 * exp(-ar / 1e5) * (1 - phi) ^ ((5.1 + 2.7 * ratio) / (1 + ratio)) * re
}

FNR == 1 { file++ }

file == 1 && /^[0-9]/ {
    split($0, column, ",")
    if (column[1] == phi) table = column[2]
}

file == 2 && FNR == 1 {
    n = split($0, column, ",")
    for (i = 1; i <= n; i++) { sub(/ \(.*/, "", column[i]); at[column[i]] = i }
}
file == 2 && FNR > 1 {
    split($0, value, ",")
    rows++
    t[rows] = value[at["t_star"]]
    flux[rows] = value[at["net_flux_z"]]
    contacts[rows] = value[at["contacts"]]
    overlap[rows] = value[at["max_overlap"]]
}

# Indented JSON: one key to a line.
file == 3 && /^ *"[a-z_]+": [0-9."-]/ {
    key = $1; gsub(/[":]/, "", key)
    number = $2; gsub(/[",]/, "", number)
    of[key] = number
}
file == 3 && /"averaged_over": \[/ { getline; from = $1 + 0 }

END {
    for (i = 1; i <= rows; i++) {
        if (t[i] < from) continue
        m++; mean_flux += flux[i]; mean_contacts += contacts[i]; mean_overlap += overlap[i]
    }
    u = of["settling_velocity_over_stokes"]
    ar = of["archimedes"]; actual = of["volume_fraction"]
    gay = correlation(ar, actual) / (ar / 18)
    # `fluid_only` is the physical problem for gravity g / (1 - phi).
    if (balance == "mixture")
        factor = correlation(ar, actual) / correlation(ar / (1 - actual), actual)
    else
        factor = 1
    # A short trial has none.
    error = "standard_error" in of ? sprintf("%.5f", of["standard_error"]) : ""
    printf "%s,%s,%.5f,%s,%.3f,%.5f,%.4f,%.4f,%.4f,%.5f,%.2f,%.4f,%.1f,%s\n",
        phi, balance, u, error, table, gay, u / table, u / gay, factor,
        mean_flux / m / of["stokes_velocity"], mean_contacts / m / of["particles"], mean_overlap / m,
        of["mlups"], of["version"]
}
