//! Scene files in messages, as the text that they are on disks.

use deepshadow::scene::SceneFile;
use serde::de::Error as _;
use serde::ser::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Writes a scene file.
///
/// # Errors
/// If it cannot be written as text.
pub fn serialize<S: Serializer>(file: &SceneFile, to: S) -> Result<S::Ok, S::Error> {
    file.to_text().map_err(S::Error::custom)?.serialize(to)
}

/// Reads a scene file.
///
/// # Errors
/// If the text is none.
pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<SceneFile, D::Error> {
    toml::from_str(&String::deserialize(from)?).map_err(D::Error::custom)
}

/// The same of one that may be missing.
pub mod optional {
    use super::{Deserialize, Deserializer, SceneFile, Serializer};

    /// Writes a scene file, if there is one.
    ///
    /// # Errors
    /// If it cannot be written as text.
    pub fn serialize<S: Serializer>(file: &Option<SceneFile>, to: S) -> Result<S::Ok, S::Error> {
        match file {
            Some(file) => super::serialize(file, to),
            None => to.serialize_none(),
        }
    }

    /// Reads a scene file, if there is one.
    ///
    /// # Errors
    /// If the text is none.
    pub fn deserialize<'a, D: Deserializer<'a>>(from: D) -> Result<Option<SceneFile>, D::Error> {
        use serde::de::Error as _;

        let text = Option::<String>::deserialize(from)?;
        text.map(|text| toml::from_str(&text).map_err(D::Error::custom)).transpose()
    }
}
