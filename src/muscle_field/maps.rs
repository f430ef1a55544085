//! Several subjects on one face: mean, spread and difference of their fields, vertex by vertex.
//!
//! Subjects fitted with the same face model share its topology, so that vertex 205 is the same place of skin on each of them. Their fields
//! are compared there, as signed components along the fibres or as lengths; no face is warped onto another for it.

/// Fields of several subjects, put together vertex by vertex.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Maps {
    /// Number of subjects that know each vertex.
    pub count: Vec<u32>,
    /// Mean over those.
    pub mean: Vec<Option<f64>>,
    /// Standard deviation over those (n − 1); absent for fewer than two.
    pub spread: Vec<Option<f64>>,
    /// The first subject less the second, where both know the vertex.
    pub difference: Vec<Option<f64>>,
}

/// Fields that cannot be put together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum MapsError {
    /// Other faces.
    #[error(
        "the faces have {first} and {other} vertices: only subjects fitted with the same face model can be compared"
    )]
    Topology {
        /// Vertices of the first.
        first: usize,
        /// Vertices of the one that differs.
        other: usize,
    },
    /// Nothing to compare.
    #[error("there is no subject")]
    None,
}

/// Puts fields together; each has a value a vertex, absent where nothing is known.
///
/// # Errors
/// Fields of different lengths, and none at all.
pub fn maps(fields: &[Vec<Option<f64>>]) -> Result<Maps, MapsError> {
    let first = fields.first().ok_or(MapsError::None)?;
    if let Some(other) = fields.iter().find(|f| f.len() != first.len()) {
        return Err(MapsError::Topology { first: first.len(), other: other.len() });
    }
    let mut maps = Maps::default();
    for v in 0..first.len() {
        let values: Vec<f64> = fields.iter().filter_map(|f| f[v]).filter(|x| x.is_finite()).collect();
        let n = values.len() as f64;
        let mean = (!values.is_empty()).then(|| values.iter().sum::<f64>() / n);
        let squares = |mean: f64| values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>();
        maps.count.push(values.len() as u32);
        maps.spread.push(mean.filter(|_| values.len() > 1).map(|mean| (squares(mean) / (n - 1.0)).sqrt()));
        maps.mean.push(mean);
        let pair = first[v].zip(fields.get(1).and_then(|f| f[v]));
        maps.difference.push(pair.map(|(a, b)| a - b).filter(|d| d.is_finite()));
    }
    Ok(maps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_spread_and_difference_are_those_of_the_known_values() {
        // Vertex 0: 1, 3, 5: mean 3, sd √((4 + 0 + 4)/2) = 2, difference −2. Vertex 1: only the second knows it. Vertex 2: first and third.
        let fields = [
            vec![Some(1.0), None, Some(2.0), None],
            vec![Some(3.0), Some(7.0), None, Some(f64::NAN)],
            vec![Some(5.0), None, Some(4.0), None],
        ];
        let m = maps(&fields).unwrap();
        assert_eq!(m.count, [3, 1, 2, 0]);
        assert_eq!(m.mean, [Some(3.0), Some(7.0), Some(3.0), None]);
        assert_eq!(m.spread, [Some(2.0), None, Some(2.0_f64.sqrt()), None]);
        assert_eq!(m.difference, [Some(-2.0), None, None, None]);
    }

    #[test]
    fn other_faces_are_refused() {
        let wrong = maps(&[vec![None; 3], vec![None; 4]]).unwrap_err();
        assert_eq!(wrong, MapsError::Topology { first: 3, other: 4 });
        assert_eq!(maps(&[]).unwrap_err(), MapsError::None);
    }
}
