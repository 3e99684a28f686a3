//! A table of a scene file that may stand there once (`[light]`) or several times (`[[light]]`).

use std::fmt;
use std::marker::PhantomData;

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};

/// One table or several, never none.
#[derive(Clone, Debug, PartialEq)]
pub struct OneOrMore<T> {
    first: T,
    more: Vec<T>,
}

impl<T> OneOrMore<T> {
    /// The first.
    pub fn first(&self) -> &T {
        &self.first
    }

    /// The first, to be changed.
    pub fn first_mut(&mut self) -> &mut T {
        &mut self.first
    }

    /// All of them, in order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        std::iter::once(&self.first).chain(&self.more)
    }

    /// All of them, in order, to be changed.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        std::iter::once(&mut self.first).chain(&mut self.more)
    }

    /// Whether there is one only.
    pub fn is_single(&self) -> bool {
        self.more.is_empty()
    }
}

impl<T: Default> Default for OneOrMore<T> {
    fn default() -> Self {
        Self { first: T::default(), more: Vec::new() }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMore<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Tables(PhantomData))
    }
}

/// Tells the two by what is there, so that an error in a table names its own key and place.
struct Tables<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Tables<T> {
    type Value = OneOrMore<T>;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a table or several")
    }

    fn visit_map<M: MapAccess<'de>>(self, map: M) -> Result<Self::Value, M::Error> {
        let first = T::deserialize(MapAccessDeserializer::new(map))?;
        Ok(OneOrMore { first, more: Vec::new() })
    }

    fn visit_seq<S: SeqAccess<'de>>(self, seq: S) -> Result<Self::Value, S::Error> {
        let mut all = Vec::<T>::deserialize(SeqAccessDeserializer::new(seq))?.into_iter();
        let first = all.next().ok_or_else(|| S::Error::custom("at least one table is needed"))?;
        Ok(OneOrMore { first, more: all.collect() })
    }
}
