use super::*;
use proptest::prelude::*;

const BOX: Domain = Domain { faces: Domain::faces([true; 3]), cells: [21, 34, 47], dx: 0.5 };

/// A bed on the floor of a closed tank: a layer of cells within it is eight times the work of one above it.
fn bed(cells: [usize; 3], height: usize) -> (Domain, Weights) {
    let domain = Domain { faces: Domain::faces([false; 3]), cells, dx: 1e-3 };
    let mut weights = Weights::even(&domain, 1.0);
    weights.layers[2][..height].iter_mut().for_each(|layer| *layer *= 8.0);
    let total: f64 = weights.layers[2].iter().sum();
    for axis in 0..2 {
        weights.layers[axis].fill(total / cells[axis] as f64);
    }
    (domain, weights)
}

/// The work of each block when every layer across z has the same work everywhere.
fn work(cut: &Decomposition, weights: &Weights) -> Vec<f64> {
    let [nx, ny, _] = cut.domain.cells;
    (0..cut.ranks())
        .map(|rank| {
            let block = cut.block(rank);
            let [x, y, _] = block.size();
            let layers: f64 = weights.layers[2][block.lo[2]..block.hi[2]].iter().sum();
            layers * (x * y) as f64 / (nx * ny) as f64
        })
        .collect()
}

/// Cuts with blocks of 4, 5, 6, ... cells, as many as fit, at most `most`.
fn uneven_cuts(cells: usize, most: usize) -> Vec<usize> {
    let mut cuts = vec![0];
    for width in 4.. {
        let next = cuts[cuts.len() - 1] + width;
        if cuts.len() >= most || next + width > cells {
            break;
        }
        cuts.push(next);
    }
    cuts.push(cells);
    cuts
}

/// Decompositions of `domain`: equal, balanced for a bed, and with cuts anywhere.
fn decompositions(domain: Domain) -> Vec<Decomposition> {
    let mut weights = Weights::even(&domain, 1.0);
    for axis in 0..3 {
        let n = domain.cells[axis] / 3;
        weights.layers[axis][..n].iter_mut().for_each(|layer| *layer *= 5.0);
    }
    let mut all = vec![Decomposition::with_cuts(domain, domain.cells.map(|cells| uneven_cuts(cells, 5)))];
    for ranks in 1..=48 {
        all.extend(Decomposition::new(domain, ranks));
        all.extend(Decomposition::balanced(domain, ranks, &weights));
    }
    all
}

#[test]
fn blocks_cover_every_cell_once_for_any_rank_count_and_any_cuts() {
    for cells in [[21, 34, 47], [4, 5, 53], [16, 16, 16], [97, 7, 13]] {
        for cut in decompositions(Domain { cells, ..BOX }) {
            let mut owner = vec![None; cut.domain.cell_count()];
            for rank in 0..cut.ranks() {
                let Block { lo, hi } = cut.block(rank);
                assert!((0..3).all(|i| hi[i] >= lo[i] + MIN_BLOCK));
                for z in lo[2]..hi[2] {
                    for y in lo[1]..hi[1] {
                        for x in lo[0]..hi[0] {
                            let cell = &mut owner[x + cells[0] * (y + cells[1] * z)];
                            assert_eq!(cell.replace(rank), None, "{:?}", cut.cuts);
                        }
                    }
                }
            }
            assert!(owner.iter().all(Option::is_some), "{:?}", cut.cuts);
        }
    }
}

#[test]
fn primes_and_counts_that_divide_nothing_are_cut() {
    for ranks in [2, 3, 5, 7, 11, 13, 26, 33, 35, 37, 39] {
        let domain = Domain { cells: [47, 53, 151], ..BOX };
        let cut = Decomposition::new(domain, ranks).unwrap();
        assert_eq!(cut.ranks(), ranks);
    }
}

#[test]
fn a_position_has_one_owner_whose_block_holds_its_cell_on_faces_and_at_the_ends_of_the_box() {
    let below = |x: f64| f64::from_bits(x.to_bits() - 1);
    let above = |x: f64| f64::from_bits(x.to_bits() + 1);
    for periodic in [[true; 3], [false; 3], [true, false, true]] {
        // Sizes of a cell that have no exact binary form.
        for dx in [0.5, 0.1, 1.5e-3 / 7.0] {
            let domain = Domain { dx, faces: Domain::faces(periodic), ..BOX };
            for cut in decompositions(domain) {
                let size = domain.size();
                for axis in 0..3 {
                    let length = size[axis];
                    let mut places = vec![-1e-25, -0.0, 0.0, below(length), length, above(length)];
                    for &at in &cut.cuts[axis][1..] {
                        let face = at as f64 * dx;
                        places.extend([below(face), face, above(face)]);
                    }
                    for x in places {
                        let mut at = size * 0.37;
                        at[axis] = x;
                        let at = domain.wrap(at);
                        let owner = cut.owner(at);
                        let cell = domain.cell_of(at);
                        let holders: Vec<usize> = (0..cut.ranks())
                            .filter(|&rank| {
                                let Block { lo, hi } = cut.block(rank);
                                (0..3).all(|i| (lo[i]..hi[i]).contains(&cell[i]))
                            })
                            .collect();
                        assert_eq!(holders, [owner], "{x} along axis {axis} of {:?}", cut.cuts);
                    }
                }
            }
        }
    }
}

#[test]
fn a_count_that_would_make_blocks_too_thin_is_refused_and_the_next_smaller_named() {
    let small = Domain { faces: Domain::faces([true; 3]), cells: [8, 8, 8], dx: 1.0 };
    let even = Weights::even(&small, 1.0);
    assert!(Decomposition::new(small, 3).is_none());
    assert!(Decomposition::balanced(small, 3, &even).is_none());
    assert_eq!(Decomposition::max_ranks(small, 100), 8);
    assert_eq!(Decomposition::max_ranks(small, 7), 4);
    assert_eq!(Decomposition::max_ranks(BOX, 100_000), 5 * 8 * 11);
}

/// Ranks near a rank by asking all of them; the distance of two blocks by their centres.
fn neighbours_by_exhaustive_search(cut: &Decomposition, rank: usize, reach: f64) -> Vec<usize> {
    let own = cut.block(rank);
    let near = |a: &Block, b: &Block, i: usize| {
        let centre = |b: &Block| 0.5 * (b.lo[i] + b.hi[i]) as f64;
        let offset = (centre(a) - centre(b)).abs();
        let distance = cut.domain.shorter_way(i, offset * cut.domain.dx);
        distance - 0.5 * ((a.hi[i] - a.lo[i]) + (b.hi[i] - b.lo[i])) as f64 * cut.domain.dx <= reach
    };
    (0..cut.ranks())
        .filter(|&other| other != rank && (0..3).all(|i| near(&own, &cut.block(other), i)))
        .collect()
}

#[test]
fn neighbours_are_mutual_and_those_of_an_exhaustive_search() {
    for periodic in [[true; 3], [false; 3], [false, true, true]] {
        for cut in decompositions(Domain { faces: Domain::faces(periodic), ..BOX }) {
            // No multiple of the cells: the exhaustive search rounds.
            for reach in [0.01, 0.9, 2.3, 4.1, 7.7, 30.3] {
                let all: Vec<_> = (0..cut.ranks()).map(|rank| cut.neighbours(rank, reach)).collect();
                for (rank, near) in all.iter().enumerate() {
                    assert_eq!(
                        *near,
                        neighbours_by_exhaustive_search(&cut, rank, reach),
                        "{:?}, rank {rank}, {reach}",
                        cut.cuts
                    );
                    assert!(near.iter().all(|&other| all[other].contains(&rank)));
                }
            }
        }
    }
}

#[test]
fn every_rank_one_step_away_in_the_grid_is_a_neighbour() {
    for cut in decompositions(BOX) {
        for rank in 0..cut.ranks() {
            let [x, y, z] = cut.grid_index(rank).map(|p| p as isize);
            for d in 0..27_isize {
                let other = cut.rank_at([x + d % 3 - 1, y + d / 3 % 3 - 1, z + d / 9 - 1]);
                assert!(other == rank || cut.neighbours(rank, 0.0).contains(&other));
            }
        }
    }
}

#[test]
fn a_hundred_thousand_ranks_take_memory_and_time_along_the_axes_only() {
    let (domain, mut weights) = bed([4000, 4000, 4000], 900);
    weights.face = 1.0;
    let cut = Decomposition::balanced(domain, 100_000, &weights).unwrap();
    assert_eq!(cut.ranks(), 100_000);
    assert!(cut.cuts.iter().map(Vec::len).sum::<usize>() < 1000);
    let middle = cut.rank_of(cut.grid.map(|n| n / 2));
    assert_eq!(cut.neighbours(middle, 1e-9).len(), 26);
}

#[test]
fn a_box_with_a_bed_on_its_floor_is_shared_out_to_within_a_few_per_cent_on_2_to_16_ranks() {
    let (domain, weights) = bed([96, 96, 240], 50);
    for ranks in 2..=16 {
        let of = |cut: &Decomposition| {
            let work = work(cut, &weights);
            let mean = work.iter().sum::<f64>() / ranks as f64;
            work.into_iter().fold(0.0, f64::max) / mean
        };
        let cut = Decomposition::balanced(domain, ranks, &weights).unwrap();
        assert!(of(&cut) < 1.06, "{ranks} ranks: {}, {:?}", of(&cut), cut.cuts);
        let equal = Decomposition::with_grid(domain, [1, 1, ranks]);
        assert!(of(&equal) > 1.5, "{ranks} equal slabs: {}", of(&equal));
    }
}

#[test]
fn a_grid_that_shares_out_exactly_gives_way_to_one_with_less_surface_if_faces_cost_much() {
    let (domain, mut weights) = bed([64, 64, 256], 9);
    for (face, grid) in [(0.0, [1, 2, 1]), (100.0, [1, 1, 2])] {
        weights.face = face;
        assert_eq!(Decomposition::balanced(domain, 2, &weights).unwrap().grid, grid);
    }
}

#[test]
fn blocks_shorter_than_a_chunk_are_avoided() {
    let domain = Domain { cells: [40, 24, 24], ..BOX };
    let mut weights = Weights::even(&domain, 1.0);
    weights.chunk = 16;
    // Half of 40 is 20 and costs 32; a third of 24 is 8.
    assert_eq!(Decomposition::balanced(domain, 2, &weights).unwrap().grid, [1, 1, 2]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn places_around_one_are_found_in_both_directions_and_round_the_back(
        count in 1..12_usize,
        p in 0..12_usize,
        below in 0..12_usize,
        above in 0..12_usize,
        periodic: bool,
    ) {
        let p = p % count;
        // On a ring steps up and steps down; on a line the difference.
        let accepts = |q: usize| {
            if periodic {
                (q + count - p) % count <= above || (p + count - q) % count <= below
            } else {
                q <= p + above && p <= q + below
            }
        };
        let all: Vec<usize> = (0..count).filter(|&q| accepts(q)).collect();
        prop_assert_eq!(around(p, count, periodic, accepts), all);
    }
}
