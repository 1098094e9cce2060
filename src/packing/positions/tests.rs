use super::columns::{MAX_ID, from_angles};
use super::*;
use proptest::prelude::*;
use std::collections::BTreeMap;

/// Reads a text that is all that is known.
fn parse(text: &str, name: &str) -> Result<Vec<Placement>, String> {
    super::parse(text.as_bytes(), name, &Columns::default(), false).map(|found| found.placements)
}

/// Reads a text with some of its columns mapped.
fn mapped(text: &str, columns: &[(&str, &str)]) -> Result<Vec<Placement>, String> {
    let texts: BTreeMap<String, String> =
        columns.iter().map(|(key, text)| ((*key).to_owned(), (*text).to_owned())).collect();
    let columns = Columns::new(&texts).map_err(|(key, what)| format!("{key} {what}"))?;
    super::parse(text.as_bytes(), "p", &columns, false).map(|found| found.placements)
}

fn three(at: f64) -> Vec3 {
    Vec3::new(at, -at / 3.0, 1e-9 * at)
}

proptest! {
    #[test]
    fn all_numbers_come_back_to_the_last_bit(
        p in prop::array::uniform3(1e-9..1.0_f64), id in 0..MAX_ID, kind in 0..9_usize, a in prop::array::uniform3(-180.0..180.0),
    ) {
        let row = Row {
            id,
            kind,
            diameter: p[0],
            position: p.into(),
            orientation: from_angles(a),
            velocity: three(p[1]),
            angular_velocity: three(p[2]),
        };
        let back = parse(&format([row]), "p").unwrap();
        prop_assert_eq!(back.len(), 1);
        prop_assert_eq!(back[0].position, row.position);
        prop_assert_eq!(back[0].id, Some(id));
        prop_assert_eq!(back[0].orientation, row.orientation);
        prop_assert_eq!(back[0].kind.unwrap().0, kind as u64);
        prop_assert_eq!(back[0].diameter.unwrap().0.to_bits(), row.diameter.to_bits());
        prop_assert_eq!(back[0].motion, Some([row.velocity, row.angular_velocity]));
    }
}

#[test]
fn a_quaternion_of_few_digits_is_made_one_of_unit_length() {
    let read = parse("x,y,z,qx,qy,qz,qw\n0,0,0,0,0,0.707107,0.707107", "p").unwrap();
    assert!((read[0].orientation.norm() - 1.0).abs() < 1e-15);
    assert!((read[0].orientation * Vec3::x() - Vec3::y()).norm() < 1e-12);
    assert_eq!((read[0].motion, read[0].kind), (None, None));
}

#[test]
fn ids_that_numpy_has_written_are_whole_numbers_and_no_others_are() {
    let id = |text: &str| parse(&format!("0;0;0;0;0;0;{text}\n"), "p").map(|found| found[0].id);
    for (text, wanted) in [("0.000e+00", 0), ("1.2e+01", 12), ("7.0", 7), ("9007199254740991", MAX_ID - 1)] {
        assert_eq!(id(text), Ok(Some(wanted)), "{text}");
    }
    for text in ["1.5", "-1", "-1.0e+00", "1e16", "9.007199254740992e15", "nan", "inf", "1e"] {
        assert!(id(text).unwrap_err().contains("a whole number from 0 to 2^53"), "{text}");
    }
}

#[test]
fn rotations_apply_about_x_first_and_z_last() {
    let turned = from_angles([90.0, 0.0, 90.0]) * Vec3::y();
    assert!((turned - Vec3::z()).norm() < 1e-15, "y goes to z and stays");
    let turned = from_angles([0.0, 90.0, 90.0]) * Vec3::z();
    assert!((turned - Vec3::y()).norm() < 1e-15, "z goes to x, then to y");
}

#[test]
fn a_csv_file_may_order_its_columns_and_leave_angles_out() {
    let text = "\u{feff}# made by hand\nID, z,y,x\r\n7,0.3,0.2,0.1\r\n\n";
    let read = parse(text, "p").unwrap();
    assert_eq!(read[0].position, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!((read[0].id, read[0].line), (Some(7), 3));
}

#[test]
fn errors_name_line_column_field_and_what_was_expected() {
    for (text, words) in [
        ("0;0;0;0;0;0;1\n0;0;zero;0;0;0;2", "p:2:5: `z` is `zero`, expected a finite number"),
        ("0;0;0;0;0;0", "p:1: 6 fields instead of 7"),
        ("0;0;0;0;0;0;-1", "p:1:13: `id` is `-1`, expected a whole number"),
        ("x,y\n1,2", "p:1: no column `z`"),
        ("x,y,z,colour\n1,2,3,4", "p:1: unknown column `colour`; in the case `columns` says"),
        ("x,y,z,radius,diameter\n1,2,3,4,5", "p:1: a size is given twice"),
        ("x,y,z,radius\n1,2,3,0", "p:2:7: `radius` is `0`, expected a number above 0"),
        ("x [mm];y [furlong];z\n1;2;3", "p:1: column `y` has the unit `furlong`; known here: m, cm, mm"),
        ("x (deg),y,z\n1,2,3", "p:1: column `x` has the unit `deg`"),
        ("0,1;0;0", "p:1:1: `x` is `0,1`, expected a finite number; decimal commas must be points"),
        ("x,x,y,z\n1,2,3,4", "p:1: column `x` appears twice"),
        ("0;nan;0;0;0;0;1", "p:1:3: `y` is `nan`"),
        ("x,y,z,kind\n0,0,0,-1", "p:2:7: `kind` is `-1`"),
        ("x,y,z,diameter\n0,0,0,big", "p:2:7: `diameter` is `big`"),
        (
            "x,y,z,qx,qy,qz\n0,0,0,0,0,0",
            "p:1: a quaternion needs all of qx, qy, qz, qw, and there is no column `qw`",
        ),
        ("x,y,z,rz,qx,qy,qz,qw\n0", "p:1: an orientation is given twice"),
        ("", "p: holds no particles"),
    ] {
        let error = parse(text, "p").unwrap_err();
        assert!(error.starts_with(words), "{error}");
        assert!(error.contains("x;y;z;rx;ry;rz;id"));
    }
}

#[test]
fn a_table_may_have_any_delimiter_and_quotes() {
    let expected = [Vec3::new(0.1, 0.2, 0.3), Vec3::new(-4e-3, 5.0, 6.0)];
    for text in [
        "x;y;z;diameter\n0.1;0.2;0.3;1\n-4e-3;5;6;2\n",
        "x,y,z,diameter\n0.1,0.2,0.3,1\n-4e-3,5,6,2\n",
        "x\ty\tz\tdiameter\n0.1\t0.2\t0.3\t1\n-4e-3\t5\t6\t2\n",
        "  x   y z diameter\n 0.1 0.2   0.3 1 \n-4e-3 5 6 2",
        "\"x\",\"y\",\"z\",\"diameter\"\n\"0.1\",\"0.2\",\"0.3\",\"1\"\n\"-4e-3\",\"5\",\"6\",\"2\"\n",
        "'x' 'y' 'z' 'diameter'\n'0.1' '0.2' '0.3' '1'\n'-4e-3' '5' '6' '2'\n",
        "# x y z diameter\n0.1 0.2 0.3 1\n-4e-3 5 6 2\n",
    ] {
        let read = parse(text, "p").unwrap_or_else(|e| panic!("{e}"));
        let positions: Vec<Vec3> = read.iter().map(|p| p.position).collect();
        assert_eq!(positions, expected, "{text}");
        assert_eq!(read[1].diameter.map(|found| found.0), Some(2.0));
    }
}

#[test]
fn units_in_a_header_scale_its_columns() {
    let close = |a: f64, b: f64| assert!((a - b).abs() <= 1e-15 * b.abs(), "{a} {b}");
    for text in [
        "x [mm];y (cm);z [m];diameter [um];rz [rad];vx [mm/s];wx [deg/s]\n1;2;3;400;1;5;180\n",
        "x [mm] y (cm) z [m] diameter [\u{b5}m] rz [rad] vx [mm/s] wx [deg/s]\n1 2 3 400 1 5 180\n",
    ] {
        let read = parse(text, "p").unwrap_or_else(|e| panic!("{e}"))[0];
        for (a, b) in read.position.iter().zip([1e-3, 2e-2, 3.0]) {
            close(*a, b);
        }
        close(read.diameter.unwrap().0, 4e-4);
        let [velocity, angular_velocity] = read.motion.unwrap();
        close(velocity.x, 5e-3);
        close(angular_velocity.x, std::f64::consts::PI);
        close(read.orientation.angle(), 1.0);
    }
}

#[test]
fn arrays_of_points_keep_their_names_and_units_in_a_table() {
    let text = "\"Points:0\",\"Points:1\",\"Points:2\",\"velocity (m/s):0\",\"velocity (m/s):2\",\"equivalent_diameter (m)\"\n1,2,3,4,5,6\n";
    let read = parse(text, "p").unwrap()[0];
    assert_eq!(read.position, Vec3::new(1.0, 2.0, 3.0));
    assert_eq!(read.motion.unwrap()[0], Vec3::new(4.0, 0.0, 5.0));
    assert_eq!(read.diameter.map(|found| found.0), Some(6.0));
}

#[test]
fn a_map_of_columns_takes_factors_units_and_constants_and_leaves_others_out() {
    let text = "\"Points:0\",\"Points:1\",\"Points:2\",\"radius [mm]\",\"colour [K]\",type\n10,20,30,2,7,3\n";
    let map = [
        ("x", "1e-3*Points:0 + 0.5"),
        ("y", "Points:1 [mm]"),
        ("diameter", "2*radius"),
        ("kind", "type - 1"),
    ];
    let read = mapped(text, &map).unwrap()[0];
    assert!((read.position - Vec3::new(0.51, 0.02, 30.0)).norm() < 1e-15, "{}", read.position);
    assert!((read.diameter.unwrap().0 - 4e-3).abs() < 1e-18);
    assert_eq!(read.kind.unwrap().0, 2);
    for (map, words) in [
        (
            ("x", "2*size"),
            "p:1: no column `size`, which `columns.x` of the case names; the columns are points:0, ",
        ),
        (("x", "two*size"), "x is \"two*size\": before `*` stands a number"),
        (("x", " "), "x is \"\", which names no column"),
        (("colour", "type"), "colour is none of x, y, z"),
        (("x", "colour"), "p:1: `colour`, for `x`, has the unit `K`; known here: m"),
    ] {
        let error = mapped(text, &[map]).unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
    let error = mapped("1;2;3\n", &[("x", "2*x")]).unwrap_err();
    assert!(error.starts_with("p:1: there is no header"), "{error}");
}

#[test]
fn the_last_frame_of_an_xyz_file_is_read() {
    let text = "1\nfirst\nA 9 9 9 9 9\n\n2\nlast\nA 1 2 3 0.5 7\nB 4 5 6 0.25 8\n";
    let found = super::parse(text.as_bytes(), "a.xyz", &Columns::default(), false).unwrap();
    assert_eq!(found.notes, ["of 2 frames the last one is read"]);
    assert_eq!(found.placements.len(), 2);
    assert_eq!(found.placements[1].position, Vec3::new(4.0, 5.0, 6.0));
    assert_eq!((found.placements[1].line, found.placements[1].diameter), (8, None));
    let texts = BTreeMap::from([("radius".to_owned(), "5".to_owned())]);
    let columns = Columns::new(&texts).unwrap();
    let found = super::parse(text.as_bytes(), "a.xyz", &columns, false).unwrap();
    assert_eq!(found.placements[1].diameter.map(|found| found.0), Some(0.5));
    let extended = "1\nLattice=\"1 0 0\" Properties=species:S:1:pos:R:3:radius:R:1:id:I:1:velo:R:3\nA 1 2 3 0.5 7 1 0 2\n";
    let read = parse(extended, "b.xyz").unwrap()[0];
    assert_eq!((read.id, read.diameter.unwrap().0), (Some(7), 1.0));
    assert_eq!(read.motion.unwrap()[0], Vec3::new(1.0, 0.0, 2.0));
    for (text, words) in [
        ("x y z\n", "a.xyz:1: the number of particles is `x`"),
        ("3\n\nA 0 0 0\n", "a.xyz:1: 3 particles, but only 1 lines"),
        ("99999999999\n\n", "a.xyz:1: the number of particles is `99999999999`"),
        ("1\n\nA 0 zero 0\n", "a.xyz:3:5: `y` is `zero`"),
        ("2\n\nA 0 0 0\nA 0 0\n", "a.xyz:4: 3 fields instead of 4"),
        ("0\n\n", "a.xyz: holds no particles"),
    ] {
        let error = parse(text, "a.xyz").unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
}

const DUMP: &str = "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: BOX BOUNDS pp pp ff\n0 1\n0 1\n0 1\n\
    ITEM: ATOMS id type x y z\n1 1 0 0 0\n\
    ITEM: TIMESTEP\n500\nITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS pp pp ff\n-1 1\n-2 2\n0 8\n\
    ITEM: ATOMS id type mass x y z vx vy vz omegax omegay omegaz radius c_q[1]\n\
    4 2 9 -1.25 1 3 1 2 3 4 5 6 0.1 7\n2 1 9 0.5 -2 7 0 0 0 0 0 0 0.2 7\n";

#[test]
fn the_last_frame_of_a_dump_is_read_relative_to_its_box() {
    let found = super::parse(DUMP.as_bytes(), "post/dump500.liggghts", &Columns::default(), true).unwrap();
    let [first, second] = found.placements[..] else { panic!() };
    // Wrapped once, as the box is periodic in x.
    assert_eq!(first.position, Vec3::new(1.75, 3.0, 3.0));
    assert_eq!(second.position, Vec3::new(1.5, 0.0, 7.0));
    assert_eq!((first.id, first.kind.unwrap().0, first.diameter.unwrap().0), (Some(4), 1, 0.2));
    assert_eq!(first.motion, Some([Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]));
    assert!(found.notes[0].contains("of 2 frames") && found.notes[0].contains("time step 500"));
    assert!(found.notes[1].contains("the lower corner of the box in the file, (-1, -2, 0) m"));
    let scaled = DUMP.replace("mass x y z", "mass xs ys zs").replace("-1.25 1 3", "0.25 0.5 0.75");
    let read = parse(&scaled, "dump").unwrap();
    assert_eq!((read[0].position, read[0].kind), (Vec3::new(0.5, 2.0, 6.0), None));
    let micro = DUMP.replace("ITEM: TIMESTEP\n500", "ITEM: UNITS\nmicro\nITEM: TIMESTEP\n500");
    let read = parse(&micro, "dump").unwrap()[1];
    assert!((read.diameter.unwrap().0 - 4e-7).abs() < 1e-20 && (read.position.z - 7e-6).abs() < 1e-18);
}

#[test]
fn motions_and_mapped_columns_of_a_dump_have_its_units_and_other_units_are_refused() {
    let with = |units: &str| {
        DUMP.replace("ITEM: TIMESTEP\n500", &format!("ITEM: UNITS\n{units}\nITEM: TIMESTEP\n500"))
    };
    for (units, length, velocity, spin) in
        [("si", 1.0, 1.0, 1.0), ("cgs", 1e-2, 1e-2, 1.0), ("micro", 1e-6, 1.0, 1e6), ("nano", 1e-9, 1.0, 1e9)]
    {
        let mapped = Columns::new(&[("diameter".to_owned(), "2*radius".to_owned())].into()).unwrap();
        for columns in [Columns::default(), mapped] {
            let found = super::parse(with(units).as_bytes(), "dump", &columns, true).unwrap();
            let first = found.placements[0];
            let [v, w] = first.motion.unwrap();
            assert!((v / velocity - Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-12, "{units}: {v}");
            assert!((w / spin - Vec3::new(4.0, 5.0, 6.0)).norm() < 1e-9, "{units}: {w}");
            assert!((first.diameter.unwrap().0 / length - 0.2).abs() < 1e-12, "{units}");
            assert!(
                found.notes.iter().any(|note| note.ends_with("not read: mass, c_q[1]")),
                "{:?}",
                found.notes
            );
        }
    }
    let error = parse(&with("real"), "dump").unwrap_err();
    assert!(error.starts_with("dump:12: the units are `real`, known here: si"), "{error}");
}

#[test]
fn a_dump_that_is_cut_or_skewed_is_refused_with_its_line() {
    for (text, words) in [
        (DUMP.replace("2 1 9 0.5 -2 7 0 0 0 0 0 0 0.2 7\n", ""), "p:19: 2 particles, but only 1 lines"),
        (DUMP.replace("pp pp ff\n-1 1", "xy xz yz pp pp ff\n-1 1 0"), "p:15: the box is skewed"),
        (DUMP.replace("-2 2", "2 -2"), "p:17: expected the lower and the upper end"),
        (DUMP.replace("ATOMS\n2\n", "ATOMS\n-2\n"), "p:14: the number of particles is `-2`"),
        (DUMP.replace("-1.25", "nan"), "p:20:7: `x` is `nan`"),
        (DUMP.replace("mass x y z", "mass a b c"), "p:19: no column `x`"),
        (DUMP.replace("ITEM: BOX BOUNDS pp pp ff\n-1 1\n-2 2\n0 8\n", ""), "p:15: ATOMS without"),
        (format!("{DUMP}rest\n"), "p:22: `rest` stands where an ITEM begins"),
    ] {
        let error = parse(&text, "p").unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
}

const DATA: &str = "LIGGGHTS data file\n\n2 atoms\n1 atom types\n\n-1 1 xlo xhi\n0 1 ylo yhi\n0 4 zlo zhi\n\n\
    Masses\n\n1 1.0\n\nAtoms # sphere\n\n7 1 0.5 2500 -0.5 0.25 3 0 0 0\n3 2 0.25 2500 1 0.5 2 0 0 0\n\n\
    Velocities\n\n3 1 2 3 4 5 6\n7 0 0 0 0 0 0\n\nBonds\n\n1 1 2 3\n";

#[test]
fn a_data_file_gives_sizes_and_velocities() {
    let found = super::parse(DATA.as_bytes(), "bed.data", &Columns::default(), true).unwrap();
    let [first, second] = found.placements[..] else { panic!() };
    assert_eq!((first.id, first.diameter.unwrap().0, first.kind.unwrap().0), (Some(7), 0.5, 0));
    assert_eq!((first.position, second.position), (Vec3::new(0.5, 0.25, 3.0), Vec3::new(2.0, 0.5, 2.0)));
    assert_eq!(second.motion, Some([Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]));
    assert_eq!(first.motion, Some([Vec3::zeros(); 2]));
    for (text, words) in [
        (DATA.replace("2 atoms", "3 atoms"), "p: 3 atoms in its head, but 2"),
        (DATA.replace("2 atoms", "1 atoms"), "p:17: more atoms than the 1"),
        (DATA.replace("# sphere", "# full"), "p:16: atoms of the style `full` with 10 numbers"),
        (DATA.replace("2500 1 0.5", "2500 one 0.5"), "p:17:15: `x` is `one`"),
        (DATA.replace("0 1 ylo", "1 0 ylo"), "p:7: the lower end of the box"),
    ] {
        let error = parse(&text, "p").unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
}

const LEGACY: &str = "# vtk DataFile Version 3.0\nGenerated by LIGGGHTS\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n\
    0.5 0.25 1\n2 3 4\nVERTICES 2 4\n1 0\n1 1\nPOINT_DATA 2\nVECTORS v float\n1 2 3 4 5 6\nSCALARS radius float 1\n\
    LOOKUP_TABLE default\n0.5 0.75\nFIELD FieldData 2\nid 1 2 int\n8 3\nomega 3 2 double\n0 0 0 1 0 2\nCELL_DATA 2\n";

#[test]
fn a_legacy_file_of_vtk_is_read_as_text_and_as_binary() {
    let mut binary = LEGACY.split("POINTS").next().unwrap().replace("ASCII", "BINARY").into_bytes();
    let floats = |values: &[f32]| values.iter().flat_map(|x| x.to_be_bytes()).collect::<Vec<u8>>();
    let ints = |values: &[i32]| values.iter().flat_map(|x| x.to_be_bytes()).collect::<Vec<u8>>();
    let doubles = |values: &[f64]| values.iter().flat_map(|x| x.to_be_bytes()).collect::<Vec<u8>>();
    for (line, data) in [
        ("POINTS 2 float\n", floats(&[0.5, 0.25, 1.0, 2.0, 3.0, 4.0])),
        ("\nVERTICES 2 4\n", ints(&[1, 0, 1, 1])),
        ("\nPOINT_DATA 2\nVECTORS v float\n", floats(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])),
        ("\nSCALARS radius float 1\nLOOKUP_TABLE default\n", floats(&[0.5, 0.75])),
        ("\nFIELD FieldData 2\nid 1 2 int\n", ints(&[8, 3])),
        ("\nomega 3 2 double\n", doubles(&[0.0, 0.0, 0.0, 1.0, 0.0, 2.0])),
    ] {
        binary.extend(line.bytes().chain(data));
    }
    for bytes in [LEGACY.as_bytes(), &binary] {
        let read = super::parse(bytes, "p.vtk", &Columns::default(), false).unwrap().placements;
        assert_eq!(read[1].position, Vec3::new(2.0, 3.0, 4.0));
        assert_eq!((read[0].id, read[1].diameter.unwrap().0), (Some(8), 1.5));
        assert_eq!(read[1].motion, Some([Vec3::new(4.0, 5.0, 6.0), Vec3::new(1.0, 0.0, 2.0)]));
        // Cut anywhere, it is refused or has fewer arrays.
        for length in 0..bytes.len() {
            let _ = super::parse(&bytes[..length], "p.vtk", &Columns::default(), false);
        }
    }
    for (text, words) in [
        (LEGACY.replace("2 float", "4000000000 float"), "p: the file ends before 12000000000 numbers"),
        (LEGACY.replace("POLYDATA", "STRUCTURED_POINTS"), "p: the data set is neither POLYDATA"),
        (LEGACY.replace("0.5 0.75", "0.5 -1"), "p: point 2: `radius` is `-1`, expected a number above 0"),
        (LEGACY.replace("0.25 1", "0.25 one"), "p: the array `Points` holds something that is not a number"),
    ] {
        let error = parse(&text, "p").unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
}

#[test]
fn an_xml_file_of_vtk_is_read_in_every_encoding() {
    let points: Vec<u8> =
        [0.5, 0.25, 1.0, 2.0, 3.0, 4.0].iter().flat_map(|x: &f64| x.to_le_bytes()).collect();
    let file = |attributes: &str, array: &str, appended: &[u8]| {
        let head = format!(
            "<?xml version=\"1.0\"?>\n<!-- > -->\n<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\" header_type=\"UInt32\"{attributes}>\n\
             <PolyData><Piece NumberOfPoints=\"2\"><PointData><DataArray type=\"Float32\" Name=\"radius (m)\" format=\"ascii\">\n\
             0.5 0.75\n</DataArray></PointData><Points><DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" {array}\
             </DataArray></Points></Piece></PolyData>\n"
        );
        [head.as_bytes(), appended, b"</VTKFile>\n"].concat()
    };
    let zlib = {
        use std::io::Write as _;
        let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        encoder.write_all(&points).unwrap();
        encoder.finish().unwrap()
    };
    let lz4 = lz4_flex::block::compress(&points);
    let header =
        |numbers: &[usize]| numbers.iter().flat_map(|n| (*n as u32).to_le_bytes()).collect::<Vec<u8>>();
    let raw = |bytes: &[u8]| [b"<AppendedData encoding=\"raw\">\n_", bytes, b"\n</AppendedData>"].concat();
    let offset = "format=\"appended\" offset=\"0\">";
    let plain = [header(&[48]), points.clone()].concat();
    let base64 = format!("format=\"binary\">\n{}\n", base64(&plain));
    let parts =
        format!("format=\"binary\">{}{}", self::base64(&header(&[1, 48, 0, lz4.len()])), self::base64(&lz4));
    let files = [
        file("", "format=\"ascii\">0.5 0.25 1 2 3 4", b""),
        file("", &base64, b""),
        file("", offset, &raw(&plain)),
        file(" compressor=\"vtkLZ4DataCompressor\"", &parts, b""),
        file(
            " compressor=\"vtkZLibDataCompressor\"",
            offset,
            &raw(&[header(&[1, 65536, 48, zlib.len()]), zlib].concat()),
        ),
    ];
    for bytes in &files {
        let read = super::parse(bytes, "p.vtp", &Columns::default(), false).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(read.placements[1].position, Vec3::new(2.0, 3.0, 4.0));
        assert_eq!(read.placements[1].diameter.map(|found| found.0), Some(1.5));
        for length in 0..bytes.len() {
            let _ = super::parse(&bytes[..length], "p.vtp", &Columns::default(), false);
        }
    }
    for (bytes, words) in [
        (
            file("", offset, &raw(&header(&[4_000_000_000]))),
            "p: the array `Points` has 4000000000 bytes instead of 48",
        ),
        (file("", offset, &raw(&header(&[48]))), "p: the array `Points` ends too early"),
        (file("", "format=\"ascii\">1 2 3", b""), "p: the array `Points` has 3 numbers instead of 6"),
        (
            file(
                " compressor=\"vtkLZ4DataCompressor\"",
                offset,
                &raw(&header(&[u32::MAX as usize, 48, 0, 1])),
            ),
            "p: the array `Points` has 206158430160 bytes instead of 48",
        ),
        (
            file(" compressor=\"vtkLZMADataCompressor\"", offset, b""),
            "p: is compressed by `vtkLZMADataCompressor`",
        ),
    ] {
        let error = super::parse(&bytes, "p", &Columns::default(), false).unwrap_err();
        assert!(error.starts_with(words), "{error}");
    }
}

/// In base64.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for chunk in bytes.chunks(3) {
        let bits = (0..3).fold(0, |bits, n| bits << 8 | u32::from(*chunk.get(n).unwrap_or(&0)));
        let digit = |n: usize| char::from(DIGITS[(bits >> (18 - 6 * n) & 63) as usize]);
        text.extend((0..4).map(|n| if n > chunk.len() { '=' } else { digit(n) }));
    }
    text
}
