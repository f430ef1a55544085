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

/// Draws values without errors, the largest pointed out.
fn draw((positions, triangles, values): &Sheet, options: &HeightMapOptions) -> Result<RgbImage, HeightMapError> {
    render(&heights(positions, triangles, values), options)
}

fn heights<'a>(positions: &'a [Point3<f64>], triangles: &'a [[u32; 3]], values: &'a [Option<f64>]) -> Heights<'a> {
    Heights {
        positions,
        triangles,
        values,
        below_noise: &[],
        sets_range: &[],
        peak: None,
        finding: String::new(),
        warning: String::new(),
    }
}

fn count(picture: &RgbImage, rgb: [u8; 3]) -> usize {
    picture.pixels().filter(|p| p.0.iter().zip(rgb).all(|(a, b)| a.abs_diff(b) <= 2)).count()
}

#[test]
fn measured_skin_is_coloured_and_the_rest_is_grey() {
    let sheet = bump(21);
    let options = HeightMapOptions { title: "A bump".to_owned(), ..HeightMapOptions::default() };
    let picture = draw(&sheet, &options).unwrap();
    assert_eq!(picture.dimensions(), (1280, 960));
    // A quarter of the sheet lies below y = −41.
    assert!(count(&picture, NOT_MEASURED) > 10_000, "{}", count(&picture, NOT_MEASURED));
    // The yellow end of viridis stands on the peak and in the colour bar.
    assert!(picture.pixels().filter(|p| p.0[0] > 200 && p.0[1] > 190 && p.0[2] < 90).count() > 500);
    let none = draw(&(sheet.0.clone(), sheet.1, vec![None; sheet.0.len()]), &options).unwrap();
    assert!(none.enumerate_pixels().filter(|(x, _, p)| *x < 1100 && p.0[0] > 200 && p.0[2] < 90).count() == 0);
}

#[test]
fn the_exaggeration_is_chosen_as_said() {
    // 0.36 × 160 mm / 0.14 N = 411 mm/N, rounded down to 400.
    assert_eq!(auto_exaggeration(160.0, [0.0, 0.14]), 400.0);
}

#[test]
fn values_below_their_noise_are_hatched_dark_and_light_on_the_brightest_colour_too() {
    let (positions, triangles, values) = bump(21);
    // All at the end of the range: the brightest colour of the map everywhere.
    let flat: Vec<_> = values.iter().map(|v| v.map(|_| 0.1)).collect();
    let options = HeightMapOptions { range: Some([0.0, 0.1]), ..HeightMapOptions::default() };
    let hatched = |below: bool| {
        let below_noise = &vec![below; positions.len()][..];
        let picture = render(&Heights { below_noise, ..heights(&positions, &triangles, &flat) }, &options).unwrap();
        // Beside the legend.
        let drawn = picture.enumerate_pixels().filter(|(x, y, _)| *x < 1080 && *y > 160);
        let of = |[r, g, b]: [u8; 3]| {
            drawn
                .clone()
                .filter(|(_, _, p)| p.0[0].abs_diff(r).max(p.0[1].abs_diff(g)).max(p.0[2].abs_diff(b)) < 14)
                .count()
        };
        NOISE_HATCHING.map(of)
    };
    let [dark, _] = hatched(false);
    let [dark_below, light_below] = hatched(true);
    assert!(dark_below > dark + 5_000, "{dark} {dark_below}");
    assert!(light_below > 5_000, "{light_below}");
}

#[test]
fn what_may_not_set_the_range_does_not() {
    let (positions, triangles, mut values) = bump(21);
    let sets: Vec<bool> = (0..values.len()).map(|i| i != values.len() - 1).collect();
    let last = values.len() - 1;
    values[last] = Some(0.5);
    let draw = |sets_range: &[bool], range| {
        let drawn = Heights { sets_range, ..heights(&positions, &triangles, &values) };
        render(&drawn, &HeightMapOptions { range, ..HeightMapOptions::default() }).unwrap()
    };
    let of_the_others = automatic_range(values[..last].iter().flatten().map(|v| (*v, true)), false);
    assert!(draw(&sets, None) == draw(&[], Some(of_the_others)));
    assert!(draw(&sets, None) != draw(&sets, Some([0.0, 0.5])));
}

#[test]
fn nonsense_is_refused_by_name() {
    let (positions, triangles, values) = bump(3);
    let options = HeightMapOptions::default();
    let draw = |positions: &[Point3<f64>], triangles: &[[u32; 3]], values: &[Option<f64>]| {
        render(&heights(positions, triangles, values), &options)
    };
    assert!(matches!(draw(&positions, &triangles, &values[1..]), Err(HeightMapError::Lengths { .. })));
    let short = Heights { below_noise: &[true], ..heights(&positions, &triangles, &values) };
    assert!(matches!(render(&short, &options), Err(HeightMapError::Lengths { values: 1, .. })));
    assert!(matches!(draw(&positions, &[[0, 1, 9]], &values), Err(HeightMapError::Index { triangle: 0, .. })));
    let mut broken = values.clone();
    broken[4] = Some(f64::NAN);
    assert!(matches!(draw(&positions, &triangles, &broken), Err(HeightMapError::NotFinite("a value"))));
    // Nothing at all is still a picture.
    assert!(draw(&[], &[], &[]).is_ok());
    assert!(draw(&positions, &triangles, &[Some(0.0); 9]).is_ok());
}
