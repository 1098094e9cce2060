use super::*;
use crate::colour::Colours;

const RED: [u8; 3] = [220, 30, 30];
const BLUE: [u8; 3] = [30, 30, 220];

/// A regular octahedron whose corners lie at one from its middle.
fn octahedron() -> Mesh {
    let points: Vec<[f32; 3]> = (0..6)
        .map(|n| std::array::from_fn(|i| if n / 2 == i { 1.0 - 2.0 * (n % 2) as f32 } else { 0.0 }))
        .collect();
    let triangles = (0..8u32).map(|n| {
        let [x, y, z] = [n & 1, 2 + (n >> 1 & 1), 4 + (n >> 2 & 1)];
        let turned = (n.count_ones() & 1) == 1;
        let corners = if turned { [x, z, y] } else { [x, y, z] };
        let sum = corners.iter().fold([0.0; 3], |sum, &i| add(sum, points[i as usize]));
        Triangle { corners, normals: [unit(sum); 3], face: n }
    });
    Mesh { triangles: triangles.collect(), points, open: false }
}

pub(super) fn body(at: [f32; 3], size: f32, colour: [u8; 3]) -> Item {
    let axes = [[size, 0.0, 0.0], [0.0, size, 0.0], [0.0, 0.0, size]];
    Item { mesh: 0, shade: Some(0), axes, at, paint: Paint::Solid(colour) }
}

/// A box of length 10 seen along y.
pub(super) fn view(items: Vec<Item>) -> View {
    View {
        title: "test".into(),
        caption: String::new(),
        size: [400, 400],
        from: [0.0, -1.0, 0.0],
        up: [0.0, 0.0, 1.0],
        zoom: 1.0,
        edges: [[0.0; 3], [10.0; 3]],
        meshes: vec![octahedron()],
        items,
        seen_through: Vec::new(),
        bars: Vec::new(),
        scale: (2.0, "2 m".into()),
        threads: 1,
    }
}

/// The colour in the middle of the box.
fn middle(view: &View) -> [u8; 3] {
    let [x, y, _] = view.camera().place([5.0; 3]);
    view.figure().image().colour(x as u32, y as u32)
}

#[test]
fn the_nearer_body_hides_the_other_whatever_their_order() {
    let (near, far) = (body([5.0, 2.0, 5.0], 1.0, RED), body([5.0, 8.0, 5.0], 1.0, BLUE));
    for items in [vec![near.clone(), far.clone()], vec![far, near]] {
        let [r, _, b] = middle(&view(items));
        assert!(r > 2 * b, "{r} {b}");
    }
}

#[test]
fn the_scale_is_as_long_as_its_length_in_the_middle_of_the_box() {
    let pixels = |view: &View| {
        let [left, right] = [4.0, 4.0 + view.scale.0].map(|x| view.camera().place([x, 5.0, 5.0])[0]);
        right - left
    };
    for zoom in [1.0, 1.7] {
        let view = View { zoom, size: [1200, 900], ..view(Vec::new()) };
        let (image, y) = (view.figure().image(), 900 - (0.75 * MARGIN) as u32);
        let dark = |x: &u32| image.colour(*x, y).iter().all(|&c| c < 120);
        let first = (0..1200).find(dark).unwrap();
        let drawn = (first..1200).take_while(dark).count() as f32;
        assert!((drawn - pixels(&view)).abs() < 4.0, "{drawn} {}", pixels(&view));
    }
}

#[test]
fn a_point_is_seen_where_the_camera_places_it() {
    let edges = [[0.0, 0.0, 1.0], [4.0, 5.0, 6.0]];
    let camera = Camera::new([1.0, -2.0, 0.7], [0.0, 0.0, 1.0], edges, 1.0, (10.0, 20.0, 300.0, 400.0));
    for point in corners(edges) {
        let at @ [x, y, _] = camera.place(point);
        assert!((9.9..300.1).contains(&x) && (19.9..400.1).contains(&y), "the box fills the area: {at:?}");
        assert!(length(sub(camera.point(at), point)) < 1e-4);
    }
}

#[test]
fn a_body_in_the_shade_of_another_is_darker_and_one_among_others_is_darker_than_alone() {
    // The middle of the page shows the face that looks at the sun.
    let alone = view(vec![body([5.2, 5.0, 4.8], 1.0, [200; 3])]);
    let with = |bodies: &[[f32; 3]], size: f32| {
        let mut view = alone.clone();
        view.items.extend(bodies.iter().map(|&at| body(at, size, [200; 3])));
        middle(&view)[0]
    };
    let towards_the_sun = with(&[[3.6, 3.1, 7.6]], 2.0);
    let beside =
        with(&[[2.5, 3.5, 4.0], [7.5, 3.5, 6.0], [5.0, 3.0, 2.5], [8.0, 2.0, 8.0], [2.0, 6.0, 7.2]], 1.9);
    let alone = middle(&alone)[0];
    assert!(towards_the_sun + 40 < alone && beside + 5 < alone, "{towards_the_sun} {beside} {alone}");
}

#[test]
fn bodies_shade_each_other_also_when_seen_along_the_vertical() {
    for from in [[0.0, 0.0, 1.0], [0.03, 0.0, 1.0], [0.0, 0.0, -1.0]] {
        let alone = View { from, ..view(vec![body([5.2, 5.2, 5.0], 1.0, [200; 3])]) };
        let mut among = alone.clone();
        for [x, y] in [[2.9, 4.0], [7.8, 6.0], [4.0, 7.6], [6.0, 2.5]] {
            among.items.push(body([x, y, 5.0 + 1.2 * from[2]], 1.9, [200; 3]));
        }
        let [among, alone] = [among, alone].map(|view| middle(&view)[0]);
        assert!(among + 5 < alone, "{from:?}: {among} {alone}");
    }
}

#[test]
fn a_page_without_room_for_the_box_beside_its_bar_still_has_it_upright() {
    let bar = Bar { label: "force (N)".into(), range: (0.0, 1.0), colours: Colours::Warm };
    let small = View { size: [120, 60], bars: vec![bar], ..view(Vec::new()) };
    let camera = small.camera();
    assert!(camera.focus > 0.0 && camera.place([5.0, 5.0, 9.0])[1] < camera.place([5.0, 5.0, 1.0])[1]);
    small.figure();
}

#[test]
fn a_tube_is_seen_through_bodies_and_fainter_the_deeper_it_is() {
    let mut red = view(vec![body([5.0, 2.0, 5.0], 1.0, RED)]);
    red.meshes.push(Mesh::tube());
    let strength = |depth: f32| {
        let ends = [[2.0, depth, 5.0], [8.0, depth, 5.0]];
        let view = View {
            seen_through: vec![Item::tube(1, ends[0], ends[1], 0.4, Paint::Solid(BLUE))],
            ..red.clone()
        };
        middle(&view)[2]
    };
    let [before, inside, behind] = [strength(0.2), strength(2.0), strength(9.0)];
    assert!(before > inside && inside > behind && behind > middle(&red)[2], "{before} {inside} {behind}");
}

#[test]
fn an_image_in_space_keeps_its_colours_and_its_sides() {
    let colours = [RED, BLUE, [30, 200, 30], [230; 3]];
    let mut view = view(vec![Item {
        mesh: 0,
        shade: None,
        axes: [[10.0, 0.0, 0.0], [0.0, 0.0, -10.0], [0.0, 1.0, 0.0]],
        at: [0.0, 5.0, 10.0],
        paint: Paint::Image(Image::new(2, 2, &colours)),
    }]);
    let square = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    view.meshes = vec![Mesh::polygon(square, &[[0.0, 0.0, 1.0]; 4], true)];
    let image = view.figure().image();
    let close = |got: [u8; 3], colour: [u8; 3]| got.iter().zip(colour).all(|(a, b)| a.abs_diff(b) < 45);
    for ((x, y), colour) in [(120, 140), (260, 140), (120, 290), (260, 290)].into_iter().zip(colours) {
        assert!(close(image.colour(x, y), colour), "{x} {y}: {:?} {colour:?}", image.colour(x, y));
    }
}

#[test]
fn any_number_of_threads_draws_the_same_picture() {
    let bodies = (0..60).map(|n| {
        body(
            [(n % 5) as f32 * 2.0 + 1.0, (n / 20) as f32 * 3.0 + 1.0, (n / 5 % 4) as f32 * 2.2 + 1.0],
            1.0,
            RED,
        )
    });
    let mut view = view(bodies.collect());
    view.bars = vec![Bar { label: "speed".into(), range: (0.0, 1.0), colours: Colours::Warm }];
    let one = view.figure().encode(crate::Format::Png);
    for threads in [2, 3] {
        view.threads = threads;
        assert!(view.figure().encode(crate::Format::Png) == one, "{threads}");
    }
}

/// A heap of bodies of all sizes, most of them behind others from any side.
pub(super) fn heap() -> Vec<Item> {
    let part = |n: u32, k: u32| (n * k % 997) as f32 / 997.0;
    (0..400)
        .map(|n| {
            let at = [1.0 + 8.0 * part(n, 7), 1.0 + 8.0 * part(n, 131), 1.0 + 8.0 * part(n, 577)];
            body(at, 0.3 + 1.5 * part(n, 89), RED)
        })
        .collect()
}
