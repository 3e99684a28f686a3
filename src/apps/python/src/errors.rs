//! Errors of the library as exceptions, with the program's one-line messages.

use deepshadow::{Error, ErrorKind};
use pyo3::PyErr;
use pyo3::exceptions::{
    PyInterruptedError, PyMemoryError, PyOSError, PyRuntimeError, PyValueError,
};

/// The exception for an error: `OSError` (and its kinds, such as `FileNotFoundError`) where the
/// system refused, `MemoryError` where a limit was met, `RuntimeError` where a device failed, else
/// `ValueError`.
pub fn raised(error: Error) -> PyErr {
    match error.kind() {
        ErrorKind::File { path, source } => match source.raw_os_error() {
            // Python chooses the kind by the number.
            Some(number) => {
                let name = path.to_string_lossy().into_owned();
                PyOSError::new_err((number, reason(source), name))
            }
            None => std::io::Error::new(source.kind(), error.to_string()).into(),
        },
        ErrorKind::Limit { .. } => PyMemoryError::new_err(error.to_string()),
        ErrorKind::Gpu { .. } => PyRuntimeError::new_err(error.to_string()),
        ErrorKind::Cancelled => PyInterruptedError::new_err("cancelled"),
        _ => PyValueError::new_err(as_keyword(&error.to_string())),
    }
}

/// Names of limits as keywords, where the program has options.
const KEYWORDS: [(&str, &str); 2] =
    [("max-map-bytes:", "max_bytes:"), ("max-error:", "max_error:")];

/// A message whose first word is a keyword.
fn as_keyword(message: &str) -> String {
    for (option, keyword) in KEYWORDS {
        if let Some(rest) = message.strip_prefix(option) {
            return format!("{keyword}{rest}");
        }
    }
    message.to_owned()
}

/// The text of a system's error without its number, which Python adds.
fn reason(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_owned()
}

/// A `ValueError` about an argument.
pub fn value(what: &str, why: impl Into<String>) -> PyErr {
    raised(Error::value(what, why))
}
