//! The actuators of one face: everything that can be tightened on its own, with its loads on the skin in newton.

use nalgebra::{Point3, Vector3};

use super::held::held;
use super::jaw;
use super::places::{Carry, nearest_seen};
use super::preset::Expression;
use super::ring::{Lid, Ring};
use super::strength::{EXTRAS, Evidence, of_action_unit};
use crate::face::{FaceModel, Muscle, Side};
use crate::muscle::{Fibre, FibreError, MuscleLaw};
use crate::simulate::{Cutoff, InSurface, Jaw, Skin, Start, muscle_force};

/// Which kind of muscle an actuator is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A muscle with a fibre from bone to skin, under the muscle law.
    Fibre,
    /// A ring of fibres.
    Sphincter,
    /// The lifter of an upper lid.
    Lid,
}

/// Whatever can be tightened on its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Actuator {
    /// Short name for files, unique in a face: `zygomaticus_major_left`.
    pub id: String,
    /// Name for people.
    pub name: String,
    /// Which kind.
    pub kind: Kind,
    /// FACS action unit that it makes, alone or with others.
    pub action_unit: u8,
    /// Side of the body; none for the ring of the mouth.
    pub side: Option<Side>,
    /// Sum of the lengths of its loads at activation 1, N.
    pub strength_n: f64,
    /// How the strength is known.
    pub evidence: Evidence,
    /// Where the strength is from.
    pub source: &'static str,
    /// Loads at activation 1 in the skin at rest: vertex and force (N), in ascending order of vertices.
    pub loads: Vec<(u32, Vector3<f64>)>,
    /// Sum of the lengths of the loads when its law's strength is 1 N; 0 for an actuator without loads.
    pub sum_per_law_newton: f64,
    /// What a person should know about its loads.
    pub note: Option<String>,
}

impl Actuator {
    /// Name for people, with the side: `frontalis, venter medialis, left`.
    pub fn label(&self) -> String {
        let name = self.name.trim_start_matches("Musculus ");
        match self.side {
            Some(Side::Left) => format!("{name}, left"),
            Some(Side::Right) => format!("{name}, right"),
            None => name.to_owned(),
        }
    }

    /// Adds its loads at an activation to those on every vertex, N.
    ///
    /// # Panics
    /// With fewer places than the face has vertices.
    pub fn add_loads(&self, activation: f64, newton: &mut [Vector3<f64>]) {
        for (v, f) in &self.loads {
            newton[*v as usize] += f * activation;
        }
    }

    /// The activation at which its law has this strength (N), as a fit finds it; 0 for an actuator without loads.
    pub fn activation_of_law_strength(&self, newton: f64) -> f64 {
        newton * self.sum_per_law_newton / self.strength_n
    }
}

/// How muscles become loads.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ActuatorSettings {
    /// How forces are made to lie in the skin.
    pub in_surface: InSurface,
    /// What is too little to act.
    pub cutoff: Cutoff,
}

/// Why a face has no actuators.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ActuatorError {
    /// Sphincters, lids and jaw have no place.
    #[error("the face lacks landmarks that sphincters, lids and jaw are placed by: {}; add them with `frontalis face import`", .missing.join(", "))]
    Landmarks {
        /// Their ids.
        missing: Vec<&'static str>,
    },
    /// As many places as vertices are needed.
    #[error("there are {found} places for the {vertices} vertices of the face")]
    Length {
        /// Places given.
        found: usize,
        /// Vertices of the face.
        vertices: usize,
    },
    /// A muscle of the face has no fibre on this skin.
    #[error("muscle {id}: {source}")]
    Fibre {
        /// The muscle.
        id: String,
        /// What is wrong with it.
        source: FibreError,
    },
}

/// Everything that moves one face.
#[derive(Clone, Debug)]
pub struct Actuators {
    /// Fibres in the order of the face model, those added, sphincters, lids.
    pub all: Vec<Actuator>,
    /// The jaw, which is no force: it is opened by an angle.
    pub jaw: Jaw,
    /// Vertices that stay on their bone: the rim of the face, and the corners of the eyes, which ligaments hold.
    pub held: Vec<bool>,
    /// What the face lacks, a sentence each.
    pub notes: Vec<String>,
    /// Whether lids and the corners of the mouth of the skin that they pull on differ from it ([`super::tissue`]); [`Actuators::of`] knows no skin and says
    /// no.
    pub tissues: bool,
}

/// The loads of an expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Loads {
    /// The force on every vertex, N.
    pub newton: Vec<Vector3<f64>>,
    /// Names in the expression that this face does not have.
    pub unknown: Vec<String>,
}

impl Actuators {
    /// The actuators of a face with its vertices at rest (mm), its own muscles under `law`.
    pub fn of(
        face: &FaceModel,
        rest: &[Point3<f64>],
        law: &MuscleLaw,
        settings: ActuatorSettings,
    ) -> Result<Self, ActuatorError> {
        let mesh = face.mesh();
        if rest.len() != mesh.len() {
            return Err(ActuatorError::Length { found: rest.len(), vertices: mesh.len() });
        }
        let carry = Carry::onto(face, rest).map_err(|missing| ActuatorError::Landmarks { missing })?;
        let normals = mesh.vertex_normals(rest);
        let skin = Skin { mesh, positions: rest, normals: &normals };
        let (muscles, mut notes) = with_added(face, rest, &normals, &carry);
        let mut all = Vec::new();
        for muscle in &muscles {
            all.push(fibre(skin, muscle, &muscles, law, settings)?);
        }
        all.extend(rings(face, skin, &carry));

        let (jaw, joined) = jaw::jaw(face, rest, &carry);
        notes.extend(joined);
        Ok(Self { all, jaw, held: held(face, rest), notes, tissues: false })
    }

    /// The muscles of a face and those that [`Self::of`] adds to it, bound to vertices.
    ///
    /// # Errors
    /// As [`Self::of`] for landmarks and lengths.
    pub fn muscles(face: &FaceModel, rest: &[Point3<f64>]) -> Result<Vec<Muscle>, ActuatorError> {
        let mesh = face.mesh();
        if rest.len() != mesh.len() {
            return Err(ActuatorError::Length { found: rest.len(), vertices: mesh.len() });
        }
        let carry = Carry::onto(face, rest).map_err(|missing| ActuatorError::Landmarks { missing })?;
        Ok(with_added(face, rest, &mesh.vertex_normals(rest), &carry).0)
    }

    /// The actuator of that name.
    pub fn get(&self, id: &str) -> Option<&Actuator> {
        self.all.iter().find(|a| a.id == id)
    }

    /// Number of vertices.
    pub fn vertices(&self) -> usize {
        self.held.len()
    }

    /// The sum of all loads, each times its activation.
    pub fn loads(&self, expression: &Expression) -> Loads {
        let mut newton = vec![Vector3::zeros(); self.vertices()];
        let mut unknown = Vec::new();
        for (id, &activation) in &expression.activations {
            match self.get(id) {
                Some(actuator) => actuator.add_loads(activation, &mut newton),
                None => unknown.push(id.clone()),
            }
        }
        Loads { newton, unknown }
    }
}

/// Loads whose lengths sum to `newton`, and the sum that they had.
fn scaled(mut loads: Vec<(u32, Vector3<f64>)>, newton: f64) -> (Vec<(u32, Vector3<f64>)>, f64) {
    loads.retain(|(_, f)| f.norm_squared() > 0.0);
    let sum: f64 = loads.iter().map(|(_, f)| f.norm()).sum();
    for (_, f) in &mut loads {
        *f *= newton / sum;
    }
    (loads, sum)
}

/// A muscle's share of the strength of its action units on its side: by the width of its band.
fn share(muscle: &Muscle, muscles: &[Muscle]) -> f64 {
    let units = of_action_unit(muscle.action_unit).action_units;
    let together =
        |m: &&Muscle| m.side == muscle.side && (m.action_unit == muscle.action_unit || units.contains(&m.action_unit));
    let width: f64 = muscles.iter().filter(together).map(|m| m.half_width_mm).sum();
    muscle.half_width_mm / width
}

fn fibre(
    skin: Skin<'_>,
    muscle: &Muscle,
    muscles: &[Muscle],
    law: &MuscleLaw,
    settings: ActuatorSettings,
) -> Result<Actuator, ActuatorError> {
    let failed = |source| ActuatorError::Fibre { id: muscle.id.clone(), source };
    let fibre = Fibre::of(muscle, skin.positions, skin.normals).map_err(failed)?;
    let ends = [muscle.attachment, muscle.insertion];
    let force = muscle_force(skin, law, &fibre, ends, &[1.0], settings.in_surface, settings.cutoff);
    let strength = of_action_unit(muscle.action_unit);
    let strength_n = strength.newton * share(muscle, muscles);
    let (loads, sum_per_law_newton) = scaled(force.loads, strength_n);
    let note = match (force.start, force.exceptions.first()) {
        (Start::Nowhere { .. }, _) => Some("its force is below the cutoff everywhere: it pulls nothing".to_owned()),
        (Start::Beside { vertex, edges }, _) => Some(format!(
            "its force at the insertion is below the cutoff; it acts from vertex {vertex}, {edges} edges beside it"
        )),
        (Start::Seed, Some((vertex, why))) => {
            let more = force.exceptions.len() - 1;
            let more = if more == 0 { String::new() } else { format!(", and {more} more such vertices") };
            Some(format!("vertex {vertex}: {}{more}", why.label()))
        }
        (Start::Seed, None) => None,
    };
    Ok(Actuator {
        id: muscle.id.clone(),
        name: muscle.latin.clone(),
        kind: Kind::Fibre,
        action_unit: muscle.action_unit,
        side: Some(muscle.side),
        strength_n,
        evidence: strength.evidence,
        source: strength.source,
        loads,
        sum_per_law_newton,
        note,
    })
}

const SIDES: [(Side, &str, f64); 2] = [(Side::Left, "left", 1.0), (Side::Right, "right", -1.0)];

fn with_added(
    face: &FaceModel,
    rest: &[Point3<f64>],
    normals: &[Vector3<f64>],
    carry: &Carry,
) -> (Vec<Muscle>, Vec<String>) {
    let mut notes = Vec::new();
    let mut muscles = face.muscles().to_vec();
    muscles.extend(added(face, rest, normals, carry, &mut notes));
    (muscles, notes)
}

/// Muscles that the six expressions need and the face does not have, bound to the vertices nearest to their places.
fn added(
    face: &FaceModel,
    rest: &[Point3<f64>],
    normals: &[Vector3<f64>],
    carry: &Carry,
    notes: &mut Vec<String>,
) -> Vec<Muscle> {
    let mut muscles = Vec::new();
    for extra in EXTRAS {
        for (side, word, sign) in SIDES {
            let id = format!("{}_{word}", extra.id);
            if face.muscles().iter().any(|m| m.id == id) {
                continue;
            }
            let vertex = |[x, y]: [f64; 2]| {
                let there = carry.there(Point3::new(sign * x, y, 0.0));
                nearest_seen([there.x, there.y], rest, normals)
            };
            match (vertex(extra.attachment), vertex(extra.insertion)) {
                (Some(attachment), Some(insertion)) if attachment != insertion => muscles.push(Muscle {
                    id,
                    latin: extra.latin.to_owned(),
                    action_unit: extra.action_unit,
                    side,
                    attachment,
                    insertion,
                    half_width_mm: extra.half_width_mm * carry.scale().x,
                    zone_half_angle_deg: None,
                }),
                _ => notes.push(format!("the mesh is too coarse for {id}: both ends lie at one vertex")),
            }
        }
    }
    muscles
}

/// Sphincters and lids of a face whose landmarks are all there.
fn rings(face: &FaceModel, skin: Skin<'_>, carry: &Carry) -> Vec<Actuator> {
    let at = |id: String| face.landmark(&id).map_or_else(Point3::origin, |l| skin.positions[l.vertex as usize]);
    let mut all = Vec::new();
    let mut push = |id: String, name: &str, kind, action_unit, side, loads: crate::simulate::Region| {
        let strength = of_action_unit(action_unit);
        let (loads, sum_per_law_newton) = scaled(loads.loads, strength.newton);
        let note = loads.is_empty().then(|| "no vertex of the skin lies under it".to_owned());
        all.push(Actuator {
            id,
            name: name.to_owned(),
            kind,
            action_unit,
            side,
            strength_n: strength.newton,
            evidence: strength.evidence,
            source: strength.source,
            loads,
            sum_per_law_newton,
            note,
        });
    };
    for (side, word, _) in SIDES {
        let (inner, outer) = (at(format!("eye_inner_{word}")), at(format!("eye_outer_{word}")));
        let wide = (outer.x - inner.x).abs() / EYE_WIDTH_MM;
        let high = carry.scale().y;
        let centre = nalgebra::center(&inner, &outer);
        let ring = |[a, b]: [f64; 2], beyond, above| Ring {
            centre: [centre.x, centre.y],
            semi_axes: [a * wide, b * high],
            beyond,
            above,
        };
        let name = "Musculus orbicularis oculi, pars orbitalis";
        let orbital = ring(ORBITAL_MM, 0.25, 0.3).loads(skin);
        push(format!("orbicularis_oculi_orbital_{word}"), name, Kind::Sphincter, 6, Some(side), orbital);
        let name = "Musculus orbicularis oculi, pars palpebralis";
        let lid = ring(LIDS_MM, 0.4, 0.5).loads(skin);
        push(format!("orbicularis_oculi_lid_{word}"), name, Kind::Sphincter, 7, Some(side), lid);
        let lid = Lid { inner, top: at(format!("eye_top_{word}")), outer, width_mm: LID_WIDTH_MM * high };
        let name = "Musculus levator palpebrae superioris";
        push(format!("levator_palpebrae_{word}"), name, Kind::Lid, 5, Some(side), lid.loads(skin));
    }
    let (left, right) = (at("mouth_corner_left".to_owned()), at("mouth_corner_right".to_owned()));
    let wide = (left.x - right.x).abs() / MOUTH_WIDTH_MM;
    let centre = nalgebra::center(&left, &right);
    let semi_axes = [MOUTH_MM[0] * wide, MOUTH_MM[1] * carry.scale().y];
    let mouth = Ring { centre: [centre.x, centre.y], semi_axes, beyond: 0.3, above: 1.0 };
    push("orbicularis_oris".to_owned(), "Musculus orbicularis oris", Kind::Sphincter, 23, None, mouth.loads(skin));
    all
}

/// Semi-axes of the rings on the generic face, whose eyes and mouth are this wide, mm.
const ORBITAL_MM: [f64; 2] = [30.0, 26.0];
const LIDS_MM: [f64; 2] = [18.0, 12.0];
const MOUTH_MM: [f64; 2] = [33.0, 22.0];
const EYE_WIDTH_MM: f64 = 26.2;
const MOUTH_WIDTH_MM: f64 = 50.7;
/// Standard deviation of the upper lid's pull across the lid, mm.
const LID_WIDTH_MM: f64 = 3.0;

#[cfg(test)]
mod tests;
