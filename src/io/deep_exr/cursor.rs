//! A cursor over bytes that never reads beyond their end. Knows nothing of their meaning.

/// The bytes that are not read yet.
#[derive(Clone)]
pub(super) struct Cursor<'a> {
    rest: &'a [u8],
}

/// The longest name of a channel, an attribute or a type.
pub(super) const LONGEST_NAME: usize = 255;

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { rest: bytes }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// Bytes left.
    pub(super) fn left(&self) -> usize {
        self.rest.len()
    }

    /// All remaining bytes.
    pub(super) fn rest(&mut self) -> &'a [u8] {
        std::mem::take(&mut self.rest)
    }

    pub(super) fn take(&mut self, count: usize) -> Result<&'a [u8], String> {
        let short = || format!("it ends early: expected {count} bytes, {} are left", self.left());
        let (taken, rest) = self.rest.split_at_checked(count).ok_or_else(short)?;
        self.rest = rest;
        Ok(taken)
    }

    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    pub(super) fn i32(&mut self) -> Result<i32, String> {
        self.array().map(i32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, String> {
        self.array().map(u64::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Result<f32, String> {
        self.array().map(f32::from_le_bytes)
    }

    /// `N` values by the same reader.
    pub(super) fn each<T: Copy + Default, const N: usize>(
        &mut self,
        read: impl Fn(&mut Self) -> Result<T, String>,
    ) -> Result<[T; N], String> {
        let mut values = [T::default(); N];
        for value in &mut values {
            *value = read(self)?;
        }
        Ok(values)
    }

    /// A name and the zero behind it; an empty name ends a list of names.
    pub(super) fn name(&mut self) -> Result<String, String> {
        let end = self.rest.iter().take(LONGEST_NAME + 1).position(|&byte| byte == 0);
        let end = end.ok_or_else(|| {
            if self.left() > LONGEST_NAME {
                format!("a name of more than {LONGEST_NAME} bytes")
            } else {
                "it ends inside a name".to_owned()
            }
        })?;
        let name = self.take(end)?;
        self.take(1)?;
        Ok(String::from_utf8_lossy(name).into_owned())
    }
}
