//! What a gateway with 64 axes takes of the memory of its host.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use axisbridge_tests::host::alone_in_real_time;

use super::local::Gateway;

/// Memory that is the process's own, locked, in kB. 16 MB of it are for the rolling recording and 3 MB for the simulated drives, which a gateway on a
/// bus does not have: with the 22 MB of the release program and its libraries it has less than 64 MB.
const OWN_MAX_KB: u64 = 45_000;

/// Four devices of 16 axes on simulated SERCOS drives, with every server.
fn configuration() -> String {
    let mut text =
        "[box]\nname = \"size\"\nsettings_file = \"size-settings.toml\"\n[time]\nsource = \"shared\"\n\
                    [history]\ndirectory = \"size-state\"\n[modbus]\nlisten = \"127.0.0.1:0\"\n\
                    [http]\nlisten = \"127.0.0.1:0\"\n"
            .to_owned();
    for device in 0..4 {
        let axes: Vec<_> = (device * 16..device * 16 + 16).map(|axis| format!("\"a{axis}\"")).collect();
        let _ = write!(
            text,
            "[[device]]\nname = \"d{device}\"\nlisten = \"127.0.0.{}\"\naxes = [{}]\n\
             update_period = {{ min = \"4 ms\", max = \"32 ms\" }}\n\
             [device.identity]\nvendor_id = 65535\nproduct_code = 1\nserial_number = {}\n",
            96 + device,
            axes.join(", "),
            device + 1
        );
    }
    text.push_str(
        "[south.sercos]\ninterface = \"in-process\"\ncycle_time = \"4 ms\"\nallowed_losses = 500\n",
    );
    for axis in 0..64 {
        let _ = write!(
            text,
            "[[south.sercos.drive]]\nname = \"s{axis}\"\naddress = {}\n\
             [[axis]]\nname = \"a{axis}\"\ninstance = {}\ndrive = \"s{axis}\"\nunit = \"revolution\"\n",
            axis + 1,
            axis % 16 + 1
        );
    }
    text
}

#[test]
fn sixty_four_axes_take_45_mb_at_most() {
    alone_in_real_time("sixty_four_axes_take_45_mb_at_most", || {
        let began = Instant::now();
        let mut gateway = Gateway::with("size", &configuration());
        let mut client = gateway.connect();
        let listens = began.elapsed();
        client.until("status a63", "ok status a63 state=inhibited ");
        let status =
            std::fs::read_to_string(format!("/proc/{}/status", gateway.run.id())).expect("a process");
        let of = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name)).expect(name);
            line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number")
        };
        let (own, all) = (of("RssAnon:"), of("VmRSS:"));
        println!("listens after {listens:?}, {own} kB of its own, {all} kB with this program");
        assert!(own < OWN_MAX_KB, "{own} kB");
        assert!(gateway.run.terminate(Duration::from_secs(30)).success(), "{}", gateway.log());
    });
}
