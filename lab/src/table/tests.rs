//! What a table promises.

use super::*;

fn table() -> Table {
    let rows = [
        ("plain", Some(0.1), 10_u64),
        ("a, \"b\"", None, 2),
        ("c", Some(f64::NAN), 3),
    ];
    let columns = [
        column("name", "", 0, |row: &(&str, Option<f64>, u64)| {
            row.0.to_owned()
        }),
        column("rate_hz", "Hz", 1, |row| row.1),
        column("n", "", 0, |row| row.2),
    ];
    Table::of("Three", &rows, &columns)
}

#[test]
fn csv_keeps_every_digit_quotes_what_it_must_and_leaves_absent_fields_empty() {
    let csv = "name,rate_hz,n\nplain,0.1,10\n\"a, \"\"b\"\"\",,2\nc,,3\n";
    assert_eq!(table().to_csv(), csv.as_bytes());
}

#[test]
fn the_terminal_sees_columns() {
    let text = "Three\n  name     rate_hz    n\n  plain        0.1   10\n  a, \"b\"         -    2\n  c              -    3\n";
    assert_eq!(table().to_string(), text);
}

#[test]
fn some_columns_can_be_selected() {
    let some = table().selected(&["n", "nothing", "name"]);
    assert_eq!(
        some.to_string(),
        "Three\n   n   name\n  10   plain\n   2   a, \"b\"\n   3   c\n"
    );
}

#[test]
fn json_is_a_list_of_records() {
    let json = serde_json::to_string(&table()).unwrap();
    assert!(
        json.starts_with(r#"[{"name":"plain","rate_hz":0.1,"n":10},"#),
        "{json}"
    );
    assert!(json.contains(r#""rate_hz":null"#));
}
