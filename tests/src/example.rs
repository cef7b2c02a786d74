//! The shipped example that needs no hardware, for tests that ask something else than how well the host keeps time.

/// `examples/two-axes-in-process.toml`.
const EXAMPLE: &str = include_str!("../../examples/two-axes-in-process.toml");

/// The example with its device at this address and with `tables` in place of Modbus.
///
/// Its axes move through a pause of the host of some 50 ms. With the cycle of the example such a pause ends the line, and at speed it is
/// a step of many cycles, which the limits of the axes do not let pass: rightly so, and it says nothing about what these tests ask.
///
/// # Panics
/// When the example has changed.
#[must_use]
pub fn two_axes(device: &str, tables: &str) -> String {
    let modbus =
        EXAMPLE.find("# Status registers").expect("Modbus")..EXAMPLE.find("[[device]]").expect("a device");
    let mut text = EXAMPLE.to_owned();
    text.replace_range(modbus, tables);
    for (shipped, here) in [
        ("127.0.0.2", device),
        ("cycle_time = \"2 ms\"", "cycle_time = \"8 ms\""),
        ("allowed_losses = 4", "allowed_losses = 100"),
        // Ahead of what else the tests run, where the host allows it.
        ("priority = 0 ", "priority = 20 "),
    ] {
        assert_eq!(text.matches(shipped).count(), 1, "the example has one {shipped:?}");
        text = text.replace(shipped, here);
    }
    text
}
