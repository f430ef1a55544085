//! From displacement to force: springs between neighbours, and the muscle forces that balance them, F = −K X.

pub mod causes;
pub mod force_field;
pub mod membrane;
pub mod skin;
pub mod springs;
pub mod stiffness;
pub mod uncertainty;

pub use causes::{Cause, causes, causes_of_spread};
pub use force_field::{internal_sum, muscle_forces, outside_table, split, strains};
pub use membrane::{Material, Membrane, Sheet};
pub use skin::{Skin, SkinModel, SkinSpec};
pub use springs::{SpringRule, Springs};
pub use stiffness::Stiffness;
pub use uncertainty::{
    Common, ForceSlopes, Influence, MarkInfluence, SpreadInfluence, standard_errors, standard_errors_of_spread,
};
