//! A table with named columns, and how it is written.

use std::io::{self, Write};

use serde::ser::{Serialize, SerializeMap, Serializer};

/// One value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Cell {
    /// Nothing: an empty field of CSV, `null` in JSON.
    None,
    /// Text.
    Text(String),
    /// A number.
    Number(i64),
    /// Yes or no.
    Bool(bool),
}

impl Cell {
    /// The field of a CSV record.
    fn text(&self) -> String {
        match self {
            Self::None => String::new(),
            Self::Text(text) => text.clone(),
            Self::Number(number) => number.to_string(),
            Self::Bool(value) => value.to_string(),
        }
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::None => serializer.serialize_none(),
            Self::Text(text) => serializer.serialize_str(text),
            Self::Number(number) => serializer.serialize_i64(*number),
            Self::Bool(value) => serializer.serialize_bool(*value),
        }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Self {
        Self::Text(text.clone())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<char> for Cell {
    fn from(letter: char) -> Self {
        Self::Text(letter.to_string())
    }
}

impl From<bool> for Cell {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

macro_rules! number {
    ($($number:ty),*) => {
        $(impl From<$number> for Cell {
            fn from(number: $number) -> Self {
                Self::Number(i64::from(number))
            }
        })*
    };
}

number!(u8, u16, u32, i64);

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Self {
        value.map_or(Self::None, Into::into)
    }
}

/// Named columns and rows of as many cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sheet {
    columns: &'static [&'static str],
    rows: Vec<Vec<Cell>>,
}

impl Sheet {
    /// A table; every row has a cell for each column.
    pub fn new(columns: &'static [&'static str], rows: Vec<Vec<Cell>>) -> Self {
        debug_assert!(rows.iter().all(|row| row.len() == columns.len()));
        Self { columns, rows }
    }

    /// CSV (RFC 4180 quoting, lines end with a line feed), with the names of the columns first.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write_csv(&self, out: impl Write) -> io::Result<()> {
        let mut writer = csv::Writer::from_writer(out);
        let into_io = |error: csv::Error| match error.into_kind() {
            csv::ErrorKind::Io(error) => error,
            other => io::Error::other(format!("{other:?}")),
        };
        writer.write_record(self.columns).map_err(into_io)?;
        for row in &self.rows {
            writer.write_record(row.iter().map(Cell::text)).map_err(into_io)?;
        }
        writer.flush()
    }

    /// A JSON array with one object in each line; its keys are the names of the columns, in their order.
    ///
    /// # Errors
    /// What the writer says.
    pub fn write_json(&self, mut out: impl Write) -> io::Result<()> {
        out.write_all(b"[")?;
        for (at, row) in self.rows.iter().enumerate() {
            out.write_all(if at == 0 { b"\n" } else { b",\n" })?;
            serde_json::to_writer(&mut out, &Object { columns: self.columns, cells: row })?;
        }
        out.write_all(b"\n]\n")
    }
}

/// A row as a JSON object.
struct Object<'a> {
    columns: &'a [&'a str],
    cells: &'a [Cell],
}

impl Serialize for Object<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.cells.len()))?;
        for (column, cell) in self.columns.iter().zip(self.cells) {
            map.serialize_entry(column, cell)?;
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sheet() -> Sheet {
        let rows = vec![
            vec![Cell::from(1_u8), "a, \"b\"\nc".into(), true.into(), Cell::None],
            vec![Cell::from(-2_i64), "²".into(), false.into(), 'R'.into()],
        ];
        Sheet::new(&["id", "text", "yes", "maybe"], rows)
    }

    #[test]
    fn csv_is_quoted_where_it_has_to_be() {
        let mut out = Vec::new();
        sheet().write_csv(&mut out).unwrap();
        let expected = "id,text,yes,maybe\n1,\"a, \"\"b\"\"\nc\",true,\n-2,²,false,R\n";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn json_has_an_object_in_each_line() {
        let mut out = Vec::new();
        sheet().write_json(&mut out).unwrap();
        let expected = concat!(
            "[\n",
            "{\"id\":1,\"text\":\"a, \\\"b\\\"\\nc\",\"yes\":true,\"maybe\":null},\n",
            "{\"id\":-2,\"text\":\"²\",\"yes\":false,\"maybe\":\"R\"}\n",
            "]\n"
        );
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn errors_of_the_writer_come_out_as_they_are() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> io::Result<usize> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> io::Result<()> {
                Err(io::ErrorKind::BrokenPipe.into())
            }
        }
        assert_eq!(sheet().write_csv(Full).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
        assert_eq!(sheet().write_json(Full).unwrap_err().kind(), io::ErrorKind::BrokenPipe);
    }
}
