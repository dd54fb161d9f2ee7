//! Settings that are one of a few names. A type has one table of its names; parsing, printing and the help of the command line share it.

use thiserror::Error;

/// A setting that is one of a few names.
pub trait Choice: Copy + 'static {
    /// Every value with its name and one line of help, in the order of the help.
    const TABLE: &'static [(Self, &'static str, &'static str)];
}

/// A name that a setting does not have.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("expected one of {expected}, found `{found}`")]
pub struct UnknownName {
    /// The names of the setting.
    pub expected: String,
    /// The name given.
    pub found: String,
}

/// Gives a type its names: [`Choice`], `Display` and `FromStr`.
macro_rules! choice {
    ($type:ident: $($value:ident = $name:literal, $help:literal;)+) => {
        impl $crate::choice::Choice for $type {
            const TABLE: &'static [(Self, &'static str, &'static str)] = &[$((Self::$value, $name, $help)),+];
        }

        impl std::fmt::Display for $type {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(match self { $(Self::$value => $name),+ })
            }
        }

        impl std::str::FromStr for $type {
            type Err = $crate::choice::UnknownName;

            fn from_str(text: &str) -> Result<Self, Self::Err> {
                match text {
                    $($name => Ok(Self::$value),)+
                    _ => Err($crate::choice::UnknownName { expected: [$($name),+].join(", "), found: text.to_owned() }),
                }
            }
        }
    };
}

pub(crate) use choice;
