//! A table of a scene file that may be absent, stand once (`[light]`) or stand several times
//! (`[[light]]`).

use std::fmt;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut};

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde::ser::{Serialize, Serializer};

/// All tables of one name, in order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tables<T>(Vec<T>);

impl<T: Default> Tables<T> {
    /// The first table, to be changed; it is added if there is none.
    pub fn one_mut(&mut self) -> &mut T {
        if self.0.is_empty() {
            self.0.push(T::default());
        }
        &mut self.0[0]
    }
}

impl<T> Default for Tables<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

/// One after another.
impl<T> From<Vec<T>> for Tables<T> {
    fn from(tables: Vec<T>) -> Self {
        Self(tables)
    }
}

impl<T> Deref for Tables<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.0
    }
}

impl<T> DerefMut for Tables<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

/// One table is written as such, several as an array.
impl<T: Serialize> Serialize for Tables<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0[..] {
            [one] => one.serialize(serializer),
            several => several.serialize(serializer),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Tables<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(OneOrMore(PhantomData))
    }
}

/// Distinguishes one table from several by its content, so that an error in a table names its own
/// key and place.
struct OneOrMore<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for OneOrMore<T> {
    type Value = Tables<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a table or an array of tables")
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
        Ok(Tables(vec![T::deserialize(MapAccessDeserializer::new(map))?]))
    }

    fn visit_seq<S: SeqAccess<'de>>(self, seq: S) -> Result<Self::Value, S::Error> {
        Vec::<T>::deserialize(SeqAccessDeserializer::new(seq)).map(Tables)
    }
}
