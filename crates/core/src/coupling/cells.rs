//! The cells of a block that the mapped bodies cover, and what a device gets of them, body by body.

use super::Coupling;
use super::KeptPolyhedra;
use super::cover::Cover;
use super::mapper::{Image, Mapper, sphere_images};
use super::method::{CouplingMethod, with_method};
use crate::fluid::{Images, LatticeSphere};

/// A body on the lattice.
enum Parts<'a> {
    /// A sphere whose cells the sweep finds.
    Sphere(LatticeSphere),
    /// Parts, each with the index of the body.
    Mapped(&'a [(u32, Mapper)]),
}

impl Coupling {
    /// Finds what a device gets of the mapped bodies. The host finds the cells of those whose geometry the device does not know, and of
    /// all if it needs them itself.
    pub(super) fn find_images(&mut self, images: &mut Images) {
        images.clear();
        let params = &self.params;
        let keeps_cover = with_method!(params.method, method => method.keeps_cover());
        let mut cover = std::mem::take(&mut self.cover);
        cover.begin(&mut self.segments);
        self.each_body(|index, parts| {
            let body = &self.bodies[index as usize];
            match parts {
                Parts::Sphere(sphere) => {
                    let (domain, centre) = (&self.decomposition.domain, body.motion.centre);
                    sphere_images(sphere, centre, domain, self.block, body.reference, index, |image| {
                        images.add_sphere(sphere, image, &body.motion);
                    });
                }
                Parts::Mapped([(_, only)]) => self.each_image(index, only, |image| {
                    images.add(only, image, keeps_cover, &mut cover, |cover| {
                        with_method!(params.method, method => method.cover(only, image, cover, params.simd));
                    });
                }),
                Parts::Mapped(parts) => {
                    let found = self.cover_parts(parts, &mut cover);
                    images.add_joined(index, &body.motion, self.block, &cover.added[found..]);
                }
            }
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
    fn each_body<'a>(&'a self, mut visit: impl FnMut(u32, Parts<'a>)) {
        let spheres = self.surfaces.iter().map(|&(body, sphere)| (body, Parts::Sphere(sphere)));
        let others =
            self.parts.chunk_by(|(a, _), (b, _)| a == b).map(|parts| (parts[0].0, Parts::Mapped(parts)));
        let mut bodies: Vec<(u32, Parts)> = spheres.chain(others).collect();
        // Mostly a few ascending runs.
        bodies.sort_by_key(|(body, _)| self.bodies[*body as usize].id);
        for (body, parts) in bodies {
            visit(body, parts);
        }
    }

    /// Calls `visit` with all images of a part of a body that may touch the block.
    fn each_image(&self, body: u32, part: &Mapper, visit: impl FnMut(&Image)) {
        let reference = self.bodies[body as usize].reference;
        part.each_image(&self.decomposition.domain, self.block, reference, body, 0.0, visit);
    }

    /// Adds the cells of the parts of a body and returns the index of the first segment. Parts that share cells are one there.
    fn cover_parts(&self, parts: &[(u32, Mapper)], cover: &mut Cover) -> usize {
        let (first, params) = (cover.added.len(), &self.params);
        let mut found = Vec::new();
        for (body, part) in parts {
            found.push(cover.added.len());
            self.each_image(*body, part, |image| {
                with_method!(params.method, method => method.cover(part, image, cover, params.simd));
            });
        }
        if parts.len() > 1 {
            cover.join(&found, parts);
        }
        first
    }

    /// Finds the cells of the mapped bodies, if they are not known yet.
    pub(super) fn find_cells(&mut self) {
        if self.found {
            return;
        }
        let [_, ny, nz] = self.block.size();
        let (method, domain) = (self.params.method, &self.decomposition.domain);
        let may_keep = |part: &Mapper| with_method!(method, method => method.may_keep(part));
        let keeps =
            KeptPolyhedra::pays(self.parts.iter().map(|(_, part)| part).filter(|part| may_keep(part)));
        let (mut spheres, mut polyhedra) = (Vec::new(), Vec::new());
        let mut kept = std::mem::take(&mut self.polyhedra);
        let mut cover = std::mem::take(&mut self.cover);
        cover.begin(&mut self.segments);
        self.each_body(|body, parts| match parts {
            Parts::Sphere(sphere) => spheres.push((body, sphere)),
            Parts::Mapped([(_, only)]) if keeps && may_keep(only) => polyhedra.push((body, only)),
            Parts::Mapped(parts) => {
                self.cover_parts(parts, &mut cover);
            }
        });
        kept.update(&polyhedra, &self.bodies, domain, self.block, self.params.simd);
        self.polyhedra = kept;
        self.segments.sort(ny * nz, &cover.added, std::mem::take(&mut cover.cut));
        self.cover = cover;
        self.spheres.update(&spheres, &self.bodies, domain, self.block);
        self.found = true;
    }
}
