//! The force field as VTK PolyData (`forces.vtp`), for ParaView and PyVista: XML with ASCII numbers, mm and N.
//!
//! The surface is that of the first frame. What is not known of a vertex is `nan`, which VTK leaves out of ranges and colours.

use std::fmt::Write as _;

use nalgebra::Vector3;

use crate::displacement::VertexState;
use crate::face::Mesh;
use crate::pipeline::Outcome;

/// The text of a `.vtp` file.
///
/// Arrays at the points, `U` being `N` or `relative` where no scale was measured: `force_U` (3 components), `force_length_U`,
/// `sigma_U`, `normal_U`, `tangential_U`, `depth_change_U`, `displacement_mm` (3), `state` (0 unmeasured, 1 measured,
/// 2 inferred, 3 fixed), `measured`, `border` and `outside_table` (0 or 1), `vertex`.
pub fn vtp(mesh: &Mesh, outcome: &Outcome) -> String {
    let unit = outcome.unit();
    let field = &outcome.field;
    let mut xml = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<PolyData>\n",
    );
    let _ = writeln!(
        xml,
        "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">",
        outcome.first.len(),
        mesh.triangles().len()
    );
    let _ = writeln!(xml, "<PointData Vectors=\"force_{unit}\" Scalars=\"force_length_{unit}\">");

    let known = |v: usize| outcome.states.get(v).is_some_and(|s| s.is_known());
    let number = |v: usize, value: f64| if known(v) { value } else { f64::NAN };
    let vector = |v: usize, value: Vector3<f64>| if known(v) { value } else { Vector3::repeat(f64::NAN) };
    let vectors = |values: &[Vector3<f64>]| values.iter().enumerate().map(|(v, f)| vector(v, *f)).collect::<Vec<_>>();
    let numbers = |values: &[f64]| values.iter().enumerate().map(|(v, f)| number(v, *f)).collect::<Vec<_>>();
    let moved: Vec<_> = outcome.last.iter().zip(&outcome.first).map(|(x1, x0)| x1 - x0).collect();
    let length: Vec<_> = field.force.iter().map(Vector3::norm).collect();

    vector_array(&mut xml, &format!("force_{unit}"), &vectors(&field.force));
    for (name, values) in [
        ("force_length", &length),
        ("sigma", &field.sigma),
        ("normal", &field.normal),
        ("tangential", &field.tangential),
        ("depth_change", &field.depth_change),
    ] {
        array(&mut xml, "Float64", &format!("{name}_{unit}"), numbers(values).iter());
    }
    vector_array(&mut xml, "displacement_mm", &vectors(&moved));
    array(&mut xml, "Int32", "state", outcome.states.iter().map(|s| state_number(*s)));
    array(&mut xml, "Int32", "measured", outcome.states.iter().map(|s| i32::from(*s == VertexState::Measured)));
    array(&mut xml, "Int32", "border", outcome.border.iter().map(|b| i32::from(*b)));
    array(&mut xml, "Int32", "outside_table", field.outside_table.iter().map(|b| i32::from(*b)));
    array(&mut xml, "Int32", "vertex", 0..outcome.first.len());

    xml.push_str("</PointData>\n<Points>\n");
    let places: Vec<_> = outcome.first.iter().map(|x| x.coords).collect();
    vector_array(&mut xml, "first_mm", &places);
    xml.push_str("</Points>\n<Polys>\n");
    array(&mut xml, "Int64", "connectivity", mesh.triangles().iter().flatten());
    array(&mut xml, "Int64", "offsets", (1..=mesh.triangles().len()).map(|t| 3 * t));
    xml.push_str("</Polys>\n</Piece>\n</PolyData>\n</VTKFile>\n");
    xml
}

/// The number of a state in the file.
fn state_number(state: VertexState) -> i32 {
    match state {
        VertexState::Unmeasured => 0,
        VertexState::Measured => 1,
        VertexState::Inferred => 2,
        VertexState::Fixed => 3,
    }
}

fn array<T: std::fmt::Display>(xml: &mut String, kind: &str, name: &str, values: impl Iterator<Item = T>) {
    let _ = writeln!(xml, "<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">");
    for (i, value) in values.enumerate() {
        let _ = write!(xml, "{}{value}", if i == 0 { "" } else { " " });
    }
    xml.push_str("\n</DataArray>\n");
}

fn vector_array(xml: &mut String, name: &str, values: &[Vector3<f64>]) {
    let _ = writeln!(xml, "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfComponents=\"3\" format=\"ascii\">");
    for v in values {
        let _ = writeln!(xml, "{} {} {}", v.x, v.y, v.z);
    }
    xml.push_str("</DataArray>\n");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::scene_of_one_triangle;

    #[test]
    fn the_unit_is_in_the_name_and_the_unmeasured_is_no_number() {
        let (_, face, mut outcome) = scene_of_one_triangle();
        let xml = vtp(face.mesh(), &outcome);
        assert!(
            xml.contains("Name=\"force_N\" NumberOfComponents=\"3\" format=\"ascii\">\n3 4 0\n-3 -4 0\nNaN NaN NaN\n")
        );
        assert!(xml.contains("Name=\"sigma_N\" format=\"ascii\">\n0.25 0.5 NaN\n"));
        assert!(xml.contains("Name=\"state\" format=\"ascii\">\n1 2 0\n"));
        assert!(xml.contains("Name=\"connectivity\" format=\"ascii\">\n0 1 2\n"));
        outcome.scale_measured = false;
        let xml = vtp(face.mesh(), &outcome);
        assert!(xml.contains("Name=\"force_relative\"") && !xml.contains("_N\""));
    }
}
