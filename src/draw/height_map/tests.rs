//! Height maps are drawn from made-up bumps, and their pixels and words are read back.

use super::*;

/// Positions, triangles and values.
type Sheet = (Vec<Point3<f64>>, Vec<[u32; 3]>, Vec<Option<f64>>);

/// A square sheet of n × n vertices, 160 mm wide, with a Gauss bump of 0.14 in the middle; the lowest rows are not measured.
fn bump(n: usize) -> Sheet {
    let at = |i: usize| (i as f64 / (n - 1) as f64 - 0.5) * 160.0;
    let positions: Vec<_> = (0..n * n).map(|k| Point3::new(at(k % n), at(k / n), 0.0)).collect();
    let value = |p: &Point3<f64>| (p.y > -41.0).then(|| 0.14 * (-(p.x * p.x + p.y * p.y) / 800.0).exp());
    let values = positions.iter().map(value).collect();
    let triangles = (0..(n - 1) * (n - 1))
        .flat_map(|k| {
            let a = (k / (n - 1) * n + k % (n - 1)) as u32;
            let n = n as u32;
            [[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]
        })
        .collect();
    (positions, triangles, values)
}

fn count(picture: &RgbImage, rgb: [u8; 3]) -> usize {
    picture.pixels().filter(|p| p.0.iter().zip(rgb).all(|(a, b)| a.abs_diff(b) <= 2)).count()
}

#[test]
fn measured_skin_is_coloured_and_the_rest_is_grey() {
    let (positions, triangles, values) = bump(21);
    let options = HeightMapOptions { title: "A bump".to_owned(), ..HeightMapOptions::default() };
    let picture = render(&positions, &triangles, &values, &options).unwrap();
    assert_eq!(picture.dimensions(), (1280, 960));
    // A quarter of the sheet lies below y = −41.
    assert!(count(&picture, NOT_MEASURED) > 10_000, "{}", count(&picture, NOT_MEASURED));
    // The yellow end of viridis stands on the peak and in the colour bar.
    assert!(picture.pixels().filter(|p| p.0[0] > 200 && p.0[1] > 190 && p.0[2] < 90).count() > 500);
    let none = render(&positions, &triangles, &vec![None; positions.len()], &options).unwrap();
    assert!(none.enumerate_pixels().filter(|(x, _, p)| *x < 1100 && p.0[0] > 200 && p.0[2] < 90).count() == 0);
}

#[test]
fn range_and_exaggeration_are_chosen_as_said() {
    assert_eq!(auto_range(&[Some(0.1), None, Some(0.142)]), [0.0, 0.142]);
    assert_eq!(auto_range(&[Some(-0.3), Some(0.142)]), [-0.3, 0.3]);
    assert_eq!(auto_range(&[None]), [0.0, 1.0]);
    // 0.36 × 160 mm / 0.14 N = 411 mm/N, rounded down to 400.
    assert_eq!(auto_exaggeration(160.0, [0.0, 0.14]), 400.0);
    assert_eq!(significant(0.142_49), "0.142");
    assert_eq!(significant(-12.34), "−12.3");
    assert_eq!(significant(250.0), "250");
}

#[test]
fn nonsense_is_refused_by_name() {
    let (positions, triangles, values) = bump(3);
    let options = HeightMapOptions::default();
    assert!(matches!(render(&positions, &triangles, &values[1..], &options), Err(HeightMapError::Lengths { .. })));
    assert!(matches!(
        render(&positions, &[[0, 1, 9]], &values, &options),
        Err(HeightMapError::Index { triangle: 0, .. })
    ));
    let mut broken = values.clone();
    broken[4] = Some(f64::NAN);
    assert!(matches!(render(&positions, &triangles, &broken, &options), Err(HeightMapError::NotFinite("a value"))));
    // Nothing at all is still a picture.
    assert!(render(&[], &[], &[], &options).is_ok());
    assert!(render(&positions, &triangles, &[Some(0.0); 9], &options).is_ok());
}
