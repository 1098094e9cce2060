//! The cells of a block that the mapped bodies cover, and what a device gets of them, body by body.

use super::Coupling;
use super::cover::Cover;
use super::mapper::{Image, Mapper};
use super::method::{CouplingMethod, with_method};
use crate::fluid::Images;

impl Coupling {
    /// Finds what a device gets of the mapped bodies. The host finds the cells of those whose geometry the device does not know, and of
    /// all if it needs them itself.
    pub(super) fn find_images(&mut self, images: &mut Images) {
        images.clear();
        let params = &self.params;
        let keeps_cover = with_method!(params.method, method => method.keeps_cover());
        let mut cover = std::mem::take(&mut self.cover);
        cover.begin(&mut self.segments);
        self.each_body(|body, parts| {
            let [(_, only)] = parts else {
                let found = self.cover_parts(parts, &mut cover);
                images.add_joined(
                    body,
                    &self.bodies[body as usize].motion,
                    self.block,
                    &cover.added[found..],
                );
                return;
            };
            self.each_image(body, only, |image| {
                images.add(only, image, keeps_cover, &mut cover, |cover| {
                    with_method!(params.method, method => method.cover(only, image, cover, params.simd));
                });
            });
        });
        images.cut.clone_from(&cover.cut);
        if keeps_cover {
            let [_, ny, nz] = self.block.size();
            self.segments.sort(ny * nz, &cover.added, std::mem::take(&mut cover.cut));
            self.found = true;
        }
        self.cover = cover;
    }

    /// Calls `visit` with the index and the parts of each body, in ascending order of ids, so that cells shared by several
    /// particles combine in the same order on every rank.
    fn each_body(&self, mut visit: impl FnMut(u32, &[(u32, Mapper)])) {
        let mut bodies: Vec<&[(u32, Mapper)]> = self.parts.chunk_by(|(a, _), (b, _)| a == b).collect();
        bodies.sort_unstable_by_key(|parts| self.bodies[parts[0].0 as usize].id);
        for parts in bodies {
            visit(parts[0].0, parts);
        }
    }

    /// Calls `visit` with all images of a part of a body that may touch the block.
    fn each_image(&self, body: u32, part: &Mapper, visit: impl FnMut(&Image)) {
        let reference = self.bodies[body as usize].reference;
        part.each_image(&self.decomposition.domain, self.block, reference, body, visit);
    }

    /// Adds the cells of the parts of a body and returns the index of the first segment. Parts that share cells are one there.
    fn cover_parts(&self, parts: &[(u32, Mapper)], cover: &mut Cover) -> usize {
        let (first, params) = (cover.added.len(), &self.params);
        for (body, part) in parts {
            self.each_image(*body, part, |image| {
                with_method!(params.method, method => method.cover(part, image, cover, params.simd));
            });
        }
        if parts.len() > 1 {
            cover.join(first);
        }
        first
    }

    /// Finds the cells of the mapped bodies, if they are not known yet.
    pub(super) fn find_cells(&mut self) {
        if self.found {
            return;
        }
        let [_, ny, nz] = self.block.size();
        let mut cover = std::mem::take(&mut self.cover);
        cover.begin(&mut self.segments);
        self.each_body(|_, parts| {
            self.cover_parts(parts, &mut cover);
        });
        self.segments.sort(ny * nz, &cover.added, std::mem::take(&mut cover.cut));
        self.cover = cover;
        self.found = true;
    }
}
