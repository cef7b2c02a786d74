//! Devices with another program than they must have.

use super::peer::{Flash, Wrong};
use super::*;

const OLD: &[u8] = b"old program";

/// 300 bytes, so that it goes in a block.
fn new_program() -> Vec<u8> {
    (0..300_u32).map(|place| ((place + 1) * 13 % 251).to_le_bytes()[0]).collect()
}

fn identification(image: &[u8]) -> u32 {
    u32::from_le_bytes(image[..4].try_into().unwrap())
}

/// Two drives, of which the first one must have the new program.
fn programmed(download: bool) -> MasterConfig {
    let mut config = network(2);
    let image = new_program();
    config.nodes[0].program = Some(ProgramConfig {
        identification: identification(&image),
        image: download.then_some(SdoData::Buffer(image)),
        time: DurationNs::from_secs(20),
    });
    config
}

fn flash(device: &mut Device, change: impl FnOnce(&mut Flash)) {
    let mut flash = Flash::new(OLD);
    change(&mut flash);
    device.objects.flash = Some(flash);
}

fn flash_of(rig: &mut Rig) -> &mut Flash {
    rig.device(1).objects.flash.as_mut().unwrap()
}

#[test]
fn a_device_with_the_right_program_keeps_it() {
    let mut rig = beside(programmed(true), |device| flash(device, |flash| flash.image = new_program()));
    rig.comes_up(&[1, 2]);
    let report = rig.master.node(id(1)).unwrap().report.iter().map(ToString::to_string);
    let steps: Vec<_> = report.filter(|row| row.starts_with("program")).collect();
    let own = identification(&new_program());
    assert_eq!(steps, [format!("program read 1F56:01: {own} ({own:#x})")]);
    assert_eq!(flash_of(&mut rig).controls, []);
}

/// Stopped, erased, written, compared, started: by itself, and through a boot loader that answers neither stop nor start.
#[test]
fn another_program_is_replaced_and_the_device_comes_again() {
    for (has_loader, busy) in [(false, 0), (false, 3), (true, 0), (true, 2)] {
        let mut rig = beside(programmed(true), |device| {
            flash(device, |flash| (flash.has_loader, flash.busy) = (has_loader, busy));
        });
        rig.until("operation", |rig| rig.state(1) == BootState::Operational);
        assert!(rig.saw(&Event::ProgramDownload { node: id(1) }));
        assert_eq!(rig.count(|event| matches!(event, Event::BootFailed { .. } | Event::Rebooted { .. })), 0);
        let flash = flash_of(&mut rig);
        assert_eq!(flash.image, new_program());
        assert_eq!((flash.runs, flash.controls.as_slice()), (true, &[0, 3, 1][..]), "{has_loader} {busy}");
        // The bytes are there for the next time, and the other device has not noticed.
        let image = rig.master.config().nodes[0].program.as_ref().unwrap().image.as_ref().unwrap();
        assert_eq!(image.as_slice(), new_program());
        rig.kept();
        rig.comes_up(&[1, 2]);
    }
}

#[test]
fn another_program_that_may_not_be_replaced() {
    let mut rig = beside(programmed(false), |device| flash(device, |_| {}));
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let (status, step) = rig.failed();
    assert_eq!(status, BootStatus::PROGRAM_OTHER);
    let (expected, found) = (identification(&new_program()), identification(OLD));
    assert_eq!(step, format!("program read 1F56:01: expected {expected:#x}, got {found:#x}"));
    assert_eq!(flash_of(&mut rig).controls, []);
    rig.kept();
}

#[test]
fn a_device_that_does_not_tell_its_program() {
    let mut rig = beside(programmed(true), |_| {});
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let step = "program read 1F56:01: refused with 06020000: object does not exist";
    assert_eq!(rig.failed(), (BootStatus::PROGRAM_VERSION, step.into()));
    rig.kept();
}

#[test]
fn downloads_that_fail() {
    type Case = (&'static str, fn(&mut Flash), Option<(u16, AbortCode)>);
    let cases: [Case; 7] = [
        ("stop refused", |_| {}, Some((0x1F51, AbortCode::LOCAL_CONTROL))),
        ("program refused", |_| {}, Some((0x1F50, AbortCode::OUT_OF_MEMORY))),
        ("data format unknown", |flash| flash.status = 2, None),
        ("never through", |flash| flash.busy = u32::MAX, None),
        ("another one runs then", |flash| flash.spoils = true, None),
        ("another one, by the loader", |flash| (flash.spoils, flash.has_loader) = (true, true), None),
        ("nothing wrong", |_| {}, None),
    ];
    let mut table = String::new();
    for (name, change, refuse) in cases {
        let mut rig = beside(programmed(true), |device| {
            flash(device, change);
            if let Some((index, code)) = refuse {
                device.objects.refuse.insert(Mux::new(index, 1), code);
            }
        });
        let over = |rig: &Rig| matches!(rig.state(1), BootState::Failed | BootState::Operational);
        rig.until("an end", over);
        let end = match rig.state(1) {
            BootState::Failed => {
                let (status, step) = rig.failed();
                format!("{status}; {step}")
            }
            state => state.to_string(),
        };
        table += &format!("{name}: {end}; 1F51 {:?}\n", flash_of(&mut rig).controls);
        assert_eq!(rig.count(|event| matches!(event, Event::ProgramDownload { .. })), 1, "{name}");
        rig.kept();
    }
    insta::assert_snapshot!(table);
}

/// What a device does not answer while it erases and writes is asked again, until the time is over.
#[test]
fn silence_is_borne_while_a_program_is_written() {
    // Five accesses identify it, and the sixth reads its program; the last but one starts it, and the last one looks whether it runs.
    for at in 7..=14 {
        let mut rig = beside(programmed(true), |device| {
            flash(device, |_| {});
            device.objects.wrong = Some((at, Wrong::Silence));
        });
        rig.comes_up(&[1, 2]);
        assert_eq!(flash_of(&mut rig).image, new_program(), "access {at}");
    }
    // One that falls silent for good is given up in time.
    let mut rig = beside(programmed(true), |device| flash(device, |_| {}));
    rig.until("erased", |rig| rig.devices[0].objects.flash.as_ref().unwrap().controls == [0, 3]);
    let before = rig.now;
    rig.device(1).mute = true;
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    let seconds = (rig.now.0 - before.0) / 1_000_000_000;
    assert!((19..=22).contains(&seconds), "{seconds}");
    let (status, step) = rig.failed();
    assert_eq!(status, BootStatus::PROGRAM_DOWNLOAD);
    assert!(step.ends_with("no answer within 500 ms"), "{step}");
    rig.kept();
}

/// A download that takes longer than a boot takes none of the time of the device that starts with it.
#[test]
fn a_device_has_its_boot_time_behind_a_long_download() {
    let mut rig = beside(programmed(true), |device| flash(device, |flash| flash.has_loader = true));
    let wrote =
        |rig: &Rig, controls: &[u8]| rig.devices[0].objects.flash.as_ref().unwrap().controls == controls;
    rig.until("erased", |rig| wrote(rig, &[0, 3]));
    rig.device(1).mute = true;
    rig.run_ms(15_000);
    rig.device(1).mute = false;
    rig.until("started", |rig| wrote(rig, &[0, 3, 1]));
    rig.device(1).mute = true;
    rig.until("retry", |rig| rig.state(1) == BootState::Retry);
    rig.run_ms(1_000);
    rig.device(1).mute = false;
    rig.comes_up(&[1, 2]);
    assert_eq!(rig.count(|event| matches!(event, Event::BootFailed { .. })), 0, "{:?}", rig.log);
    rig.kept();
}

#[test]
fn a_program_is_downloaded_once_until_the_master_is_started_again() {
    let mut rig = beside(programmed(true), |device| flash(device, |flash| flash.spoils = true));
    let downloads = |rig: &Rig| rig.count(|event| matches!(event, Event::ProgramDownload { .. }));
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    // It starts anew, and is found out at once.
    let now = rig.now;
    rig.device(1).reset(now);
    rig.until("identify", |rig| rig.state(1) == BootState::Identify);
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    assert_eq!((downloads(&rig), rig.failed().0), (1, BootStatus::PROGRAM_DOWNLOAD));
    flash_of(&mut rig).spoils = false;
    let now = rig.now;
    rig.master.retry(now, id(1)).unwrap();
    rig.until("failure", |rig| rig.state(1) == BootState::Failed);
    assert_eq!((downloads(&rig), flash_of(&mut rig).controls.as_slice()), (1, &[0, 3, 1][..]));
    rig.kept();
    rig.kept.clear();
    let now = rig.now;
    rig.master.stop(now);
    rig.run_ms(10);
    let now = rig.now;
    rig.master.start(now);
    rig.comes_up(&[1, 2]);
    assert_eq!(downloads(&rig), 2);
}
