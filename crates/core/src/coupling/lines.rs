//! The cells that particles cover, line by line of the block, and how they change from step to step.

/// Consecutive cells of a line that belong to one particle (one of its periodic images).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Segment {
    /// Particle, as an index into the list of bodies for which the segments were made.
    pub(super) body: u32,
    /// First cell of the block, and number of cells.
    pub(super) x: u32,
    pub(super) count: u32,
    /// Offset of the first cell from the reference cell of the body (of its image that lies here).
    pub(super) offset: [i32; 3],
    /// First and last offset in x of the cells that are fully solid; empty if they cross.
    pub(super) full: [i32; 2],
}

impl Segment {
    /// One past the last cell.
    pub(super) fn end(&self) -> u32 {
        self.x + self.count
    }
}

/// All segments, sorted by line; within a line in the order they were added.
#[derive(Clone, Debug, Default)]
pub(super) struct Lines {
    segments: Vec<Segment>,
    /// First segment of each line, and one past the last.
    start: Vec<u32>,
}

impl Lines {
    /// Sorts `added`, pairs of line and segment; the order within a line is kept.
    pub(super) fn sort(&mut self, lines: usize, added: &[(u32, Segment)]) {
        self.start.clear();
        self.start.resize(lines + 1, 0);
        for &(line, _) in added {
            self.start[line as usize + 1] += 1;
        }
        for line in 0..lines {
            self.start[line + 1] += self.start[line];
        }
        self.segments.clear();
        self.segments.resize(added.len(), Segment::default());
        for &(line, segment) in added {
            let next = &mut self.start[line as usize];
            self.segments[*next as usize] = segment;
            *next += 1;
        }
        // Each start has moved to the end of its line, which is the start of the next.
        self.start.rotate_right(1);
        if let Some(first) = self.start.first_mut() {
            *first = 0;
        }
    }

    /// Cells of all segments.
    pub(super) fn cells(&self) -> usize {
        self.segments.iter().map(|segment| segment.count as usize).sum()
    }

    /// Segments of a line; none before the first [`sort`](Self::sort).
    #[inline]
    pub(super) fn line(&self, line: usize) -> &[Segment] {
        match (self.start.get(line), self.start.get(line + 1)) {
            (Some(&first), Some(&end)) => &self.segments[first as usize..end as usize],
            _ => &[],
        }
    }
}

/// Calls `visit(x)` for every cell of `segment` that is in none of `others`.
pub(super) fn each_cell_outside<'a>(
    segment: &Segment,
    others: &(impl Iterator<Item = &'a Segment> + Clone),
    mut visit: impl FnMut(u32),
) {
    let mut x = segment.x;
    while x < segment.end() {
        if let Some(other) = others.clone().find(|other| (other.x..other.end()).contains(&x)) {
            x = other.end();
        } else {
            visit(x);
            x += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn segment(body: u32, x: u32, count: u32) -> Segment {
        Segment { body, x, count, ..Segment::default() }
    }

    #[test]
    fn segments_are_sorted_by_line_and_keep_their_order_within_it() {
        let mut lines = Lines::default();
        assert!(lines.line(1).is_empty());
        let added =
            [(2, segment(0, 0, 1)), (0, segment(1, 0, 1)), (2, segment(2, 0, 1)), (1, segment(3, 0, 1))];
        for _ in 0..2 {
            lines.sort(4, &added);
            let bodies = |line| lines.line(line).iter().map(|s| s.body).collect::<Vec<_>>();
            assert_eq!([bodies(0), bodies(1), bodies(2), bodies(3)], [vec![1], vec![3], vec![0, 2], vec![]]);
            assert_eq!(lines.cells(), 4);
        }
    }

    #[test]
    fn the_difference_of_a_segment_and_others_is_visited_cell_by_cell() {
        let outside = |others: &[Segment]| {
            let mut cells = Vec::new();
            each_cell_outside(&segment(0, 10, 6), &others.iter(), |x| cells.push(x));
            cells
        };
        assert_eq!(outside(&[]), [10, 11, 12, 13, 14, 15]);
        assert_eq!(outside(&[segment(0, 11, 4)]), [10, 15]);
        assert_eq!(outside(&[segment(0, 14, 9), segment(0, 0, 11)]), [11, 12, 13]);
        assert_eq!(outside(&[segment(0, 0, 40)]), [0_u32; 0]);
    }
}
