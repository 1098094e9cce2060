//! Cells that bodies cover, row by row: what is found before a sweep.

use super::solid::GROUP;

/// Consecutive cells of a row that belong to one body (one of its periodic images): some that its surface cuts (`head`), some
/// wholly solid, some cut (`tail`).
#[derive(Clone, Copy, Debug, Default)]
pub struct Segment {
    /// Index of the body.
    pub body: u32,
    /// First cell of the block.
    pub x: u32,
    /// Number of cells.
    pub count: u16,
    /// Cut cells at the start.
    pub head: u16,
    /// Cut cells at the end.
    pub tail: u16,
    /// Offset of the first cell from the reference cell of the body (of its image that lies here).
    pub offset: [i32; 3],
    /// Index of the solid fraction of the first cut cell; those of head and tail are side by side.
    pub cut: u32,
}

impl Segment {
    /// One past the last cell.
    pub(crate) fn end(&self) -> u32 {
        self.x + u32::from(self.count)
    }

    /// Solid fraction of the `k`th cell, those of the cut cells being `cut`.
    #[inline(always)]
    pub(crate) fn fraction(&self, cut: &[f32], k: usize) -> f32 {
        let (head, end) = (usize::from(self.head), usize::from(self.count - self.tail));
        match k {
            k if k < head => cut[k],
            k if k >= end => cut[head + (k - end)],
            _ => 1.0,
        }
    }
}

/// Number of cells that bodies may cover in a block (those of bodies that are kept with their skin), each counted once for each body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CoverCount {
    /// Cells.
    pub cells: usize,
    /// Those that a surface cuts.
    pub cut: usize,
    /// Segments of rows that they form.
    pub segments: usize,
}

impl CoverCount {
    /// Adds a segment.
    #[inline(always)]
    pub(super) fn add(&mut self, [cells, cut]: [usize; 2]) {
        self.cells += cells;
        self.cut += cut;
        self.segments += 1;
    }
}

/// The cells that bodies cover in the rows of a block: segments sorted by row, and the solid fractions of cut cells.
#[derive(Clone, Debug, Default)]
pub struct RowSegments {
    segments: Vec<Segment>,
    /// First segment of each row, and one past the last.
    start: Vec<u32>,
    /// Solid fractions of cut cells, and [`GROUP`] more numbers.
    cut: Vec<f32>,
}

impl RowSegments {
    /// Leaves all rows empty; returns the memory of the fractions.
    pub fn clear(&mut self) -> Vec<f32> {
        // The segments stay where they are, so that sorting others need not write each twice.
        self.start.clear();
        let mut cut = std::mem::take(&mut self.cut);
        cut.clear();
        cut
    }

    /// Sorts `added`, pairs of row and segment, which stay in their order in a row. `cut` are the fractions that they refer to.
    pub fn sort(&mut self, rows: usize, added: &[(u32, Segment)], cut: Vec<f32>) {
        self.start.clear();
        self.start.resize(rows + 1, 0);
        for (row, _) in added {
            self.start[*row as usize + 1] += 1;
        }
        let mut sum = 0;
        for start in &mut self.start {
            sum += *start;
            *start = sum;
        }
        // Each is written below.
        self.segments.resize(added.len(), Segment::default());
        for (row, segment) in added {
            let next = &mut self.start[*row as usize];
            self.segments[*next as usize] = *segment;
            *next += 1;
        }
        // Each start has moved to the end of its row, which is the start of the next.
        let mut first = 0;
        for start in &mut self.start {
            first = std::mem::replace(start, first);
        }
        self.cut = cut;
        self.cut.extend([0.0; GROUP]);
    }

    /// Tells the segments, by the former index of their body, its index and by how much offsets have grown.
    pub fn renumber(&mut self, of_bodies: &[(u32, [i32; 3])]) {
        for segment in &mut self.segments {
            let (body, moved) = of_bodies[segment.body as usize];
            segment.body = body;
            segment.offset = std::array::from_fn(|a| segment.offset[a] + moved[a]);
        }
    }

    /// The fractions that segments refer to, and more.
    pub fn fractions(&mut self) -> &mut [f32] {
        &mut self.cut
    }

    /// Segments of row `y + ny z`; none before the first [`sort`](Self::sort).
    #[inline]
    pub fn row(&self, row: usize) -> &[Segment] {
        match (self.start.get(row), self.start.get(row + 1)) {
            (Some(&first), Some(&end)) => &self.segments[first as usize..end as usize],
            _ => &[],
        }
    }

    /// Solid fractions of the cut cells of a segment, head then tail, followed by those of other segments.
    #[inline(always)]
    pub(super) fn cut(&self, segment: &Segment) -> &[f32] {
        &self.cut[segment.cut as usize..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_are_sorted_by_row_and_keep_their_order_there() {
        let segment = |body: u32, x: u32, count: u16| Segment { body, x, count, ..Segment::default() };
        let mut segments = RowSegments::default();
        assert!(segments.row(1).is_empty());
        let added = [
            (2, segment(0, 5, 6)),
            (0, segment(1, 0, 1)),
            (2, segment(2, 11, 2)),
            (2, segment(3, 3, 3)),
            (1, segment(4, 0, 1)),
            (2, segment(5, 0, 3)),
        ];
        for _ in 0..2 {
            segments.sort(4, &added, Vec::new());
            let bodies = |row| segments.row(row).iter().map(|s| s.body).collect::<Vec<_>>();
            assert_eq!(
                [bodies(0), bodies(1), bodies(2), bodies(3)],
                [vec![1], vec![4], vec![0, 2, 3, 5], vec![]]
            );
        }
    }
}
