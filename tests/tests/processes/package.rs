//! The Debian package, built of the program under test: what is in it, and what its unit starts.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::os::unix::net::UnixDatagram;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

use axisbridge_tests::host::in_real_time;
use axisbridge_tests::peer;
use axisbridge_tests::process::{Running, axisbridge};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// How long anything may take on a slow host.
const LIMIT: Duration = Duration::from_secs(60);

/// A package and what was in it.
pub struct Package {
    file: PathBuf,
    pub tree: PathBuf,
}

/// Builds the package into this folder.
fn build(folder: &Path) -> PathBuf {
    let mut build = Command::new(Path::new(ROOT).join("packaging/build-deb"));
    build.arg("--program").arg(axisbridge()).arg("--output").arg(folder);
    // A debug program is large.
    build.env("DPKG_DEB_COMPRESSOR_TYPE", "none");
    PathBuf::from(success(&mut build).trim())
}

/// The package, built once for all tests; `None` where nothing can build it.
pub fn package(test: &str) -> Option<&'static Package> {
    static BUILT: OnceLock<Package> = OnceLock::new();
    if !peer::has_program("dpkg-deb") {
        peer::skip(test, "dpkg-deb");
        return None;
    }
    Some(BUILT.get_or_init(|| {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("package");
        let _ = fs::remove_dir_all(&folder);
        let file = build(&folder);
        let tree = folder.join("tree");
        success(Command::new("dpkg-deb").arg("--raw-extract").arg(&file).arg(&tree));
        Package { file, tree }
    }))
}

/// What a command prints that ends well.
fn success(command: &mut Command) -> String {
    let output = command.output().unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The unit as it is in the package.
fn unit(package: &Package) -> String {
    fs::read_to_string(package.tree.join("usr/lib/systemd/system/axisbridge.service")).expect("the unit")
}

/// What the unit starts, with files below the unpacked package, this configuration and this socket instead of those of the host.
fn exec_start(package: &Package, config: &Path, socket: &Path) -> Command {
    let unit = unit(package);
    let line =
        unit.lines().find_map(|line| line.strip_prefix("ExecStart=")).expect("the unit starts something");
    let words: Vec<_> = line.split(' ').collect();
    assert_eq!(words[0], "/usr/bin/axisbridge");
    let mut command = Command::new(package.tree.join("usr/bin/axisbridge"));
    for word in &words[1..] {
        match *word {
            "/etc/axisbridge/gateway.toml" => command.arg(config),
            "/run/axisbridge/local" => command.arg(socket),
            word => command.arg(word),
        };
    }
    command.env_remove("RUST_LOG").env_remove("NOTIFY_SOCKET").env_remove("WATCHDOG_USEC");
    command
}

/// A folder of this test whose path is short enough for a socket.
pub fn short_folder(name: &str) -> PathBuf {
    let folder = std::env::temp_dir().join(format!("axb-{name}-{}", std::process::id()));
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("a folder for sockets");
    folder
}

fn text_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn package_has_each_file_in_its_place_with_owner_and_mode() {
    let Some(package) = package("package_has_each_file_in_its_place_with_owner_and_mode") else { return };
    let listed = success(Command::new("dpkg-deb").arg("--contents").arg(&package.file));
    let mut entries = Vec::new();
    for line in listed.lines() {
        let words: Vec<_> = line.split_whitespace().collect();
        assert_eq!(words[1], "root/root", "{line}");
        assert!(["drwxr-xr-x", "-rw-r--r--", "-rwxr-xr-x"].contains(&words[0]), "{line}");
        entries.push((words[0], words[5]));
    }
    for (mode, path) in [
        ("-rwxr-xr-x", "./usr/bin/axisbridge"),
        ("-rw-r--r--", "./usr/lib/systemd/system/axisbridge.service"),
        ("-rw-r--r--", "./usr/lib/sysusers.d/axisbridge.conf"),
        ("-rw-r--r--", "./etc/axisbridge/gateway.toml"),
        ("-rw-r--r--", "./usr/share/man/man1/axisbridge.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/axisbridge-run.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/axisbridge-init.1.gz"),
        ("-rw-r--r--", "./usr/share/man/man1/axisbridge-simulate-can-drive.1.gz"),
        ("-rw-r--r--", "./usr/share/bash-completion/completions/axisbridge"),
        ("-rw-r--r--", "./usr/share/zsh/vendor-completions/_axisbridge"),
        ("-rw-r--r--", "./usr/share/fish/vendor_completions.d/axisbridge.fish"),
        ("-rw-r--r--", "./usr/share/axisbridge/tables/cip-generic.toml"),
        ("-rw-r--r--", "./usr/share/axisbridge/tables/families/maxon.toml"),
        ("-rw-r--r--", "./usr/share/doc/axisbridge/examples/two-axes-in-process.toml"),
        ("-rw-r--r--", "./usr/share/doc/axisbridge/examples/scripts/first-move.toml"),
        ("-rw-r--r--", "./usr/share/doc/axisbridge/copyright"),
        ("-rw-r--r--", "./usr/share/doc/axisbridge/changelog.gz"),
        ("-rw-r--r--", "./usr/share/doc/axisbridge/dependencies"),
        ("-rw-r--r--", "./usr/share/doc/axisbridge/sbom.cdx.json"),
    ] {
        assert!(entries.contains(&(mode, path)), "{mode} {path} is not in\n{listed}");
    }
    let programs = entries.iter().filter(|(mode, _)| *mode == "-rwxr-xr-x");
    assert_eq!(programs.map(|(_, path)| *path).collect::<Vec<_>>(), ["./usr/bin/axisbridge"]);
    assert!(!listed.contains("axisbridge-manual"), "a hidden command has no page");

    for script in ["postinst", "prerm", "postrm"] {
        let mode = fs::metadata(package.tree.join("DEBIAN").join(script)).expect(script).permissions().mode();
        assert_eq!(mode & 0o777, 0o755, "{script}");
        success(Command::new("sh").arg("-n").arg(package.tree.join("DEBIAN").join(script)));
    }
    let fields = success(Command::new("dpkg-deb").arg("--field").arg(&package.file));
    let architecture = success(Command::new("dpkg").arg("--print-architecture"));
    for field in [
        concat!("Version: ", env!("CARGO_PKG_VERSION")),
        &format!("Architecture: {}", architecture.trim()),
        "Package: axisbridge",
    ] {
        assert!(fields.lines().any(|line| line == field), "{field:?} is not in\n{fields}");
    }
    let conffiles = fs::read_to_string(package.tree.join("DEBIAN/conffiles")).expect("the list");
    assert_eq!(conffiles, "/etc/axisbridge/gateway.toml\n");
}

#[test]
fn package_needs_the_libc_that_the_program_asks_for() {
    let Some(package) = package("package_needs_the_libc_that_the_program_asks_for") else { return };
    let field = success(Command::new("dpkg-deb").arg("--field").arg(&package.file).arg("Depends"));
    let needed = field.split_once("libc6 (>= ").and_then(|(_, rest)| rest.split_once(')')).expect("libc6").0;
    let versions = success(Command::new("readelf").args(["--version-info", "--wide"]).arg(axisbridge()));
    let number = |text: &str| -> Vec<u32> { text.split('.').filter_map(|part| part.parse().ok()).collect() };
    let of_program = versions
        .split("GLIBC_")
        .skip(1)
        .map(|rest| number(rest.split_whitespace().next().unwrap_or_default()))
        .max()
        .expect("the program calls libc");
    assert_eq!(number(needed), of_program, "{field}");
}

#[test]
fn program_for_another_architecture_is_refused() {
    let test = "program_for_another_architecture_is_refused";
    if !peer::has_program("dpkg-deb") {
        peer::skip(test, "dpkg-deb");
        return;
    }
    let other =
        if cfg!(target_arch = "x86_64") { "aarch64-unknown-linux-gnu" } else { "x86_64-unknown-linux-gnu" };
    for (target, expected) in [
        (other, format!("error: {} is not a program for {other}", axisbridge().display())),
        (
            "riscv64gc-unknown-linux-gnu",
            "error: there is no package for riscv64gc-unknown-linux-gnu: \
             expected x86_64-unknown-linux-gnu or aarch64-unknown-linux-gnu"
                .to_owned(),
        ),
    ] {
        let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("package-refused");
        let mut build = Command::new(Path::new(ROOT).join("packaging/build-deb"));
        build.arg("--program").arg(axisbridge()).args(["--target", target, "--output"]).arg(&folder);
        let output = build.output().expect("the script runs");
        assert_eq!((output.status.code(), text_of(&output).trim()), (Some(1), &*expected));
        assert!(!folder.exists(), "{} was made", folder.display());
    }
}

#[test]
fn sums_are_those_of_the_package() {
    let Some(package) = package("sums_are_those_of_the_package") else { return };
    let folder = package.file.parent().expect("the folder of the package");
    let name = package.file.file_name().and_then(|name| name.to_str()).expect("a name");
    let checked = success(Command::new("sha256sum").args(["--check", "SHA256SUMS"]).current_dir(folder));
    let bill = name.replace(".deb", ".cdx.json");
    assert_eq!(checked.trim(), format!("{name}: OK\n{bill}: OK"));
    success(Command::new("md5sum").args(["--check", "--quiet", "DEBIAN/md5sums"]).current_dir(&package.tree));
}

#[test]
fn same_program_makes_the_same_package() {
    let Some(package) = package("same_program_makes_the_same_package") else { return };
    let again = build(&PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("package-again"));
    let bytes = |path: &Path| fs::read(path).expect("a package");
    assert!(bytes(&package.file) == bytes(&again), "{} differs", again.display());
}

#[test]
fn every_crate_in_the_program_is_named_with_its_licence() {
    let Some(package) = package("every_crate_in_the_program_is_named_with_its_licence") else { return };
    let path = package.tree.join("usr/share/doc/axisbridge/dependencies");
    let list = fs::read_to_string(path).expect("the list");
    assert!(list.lines().any(|line| line.starts_with("tokio v1.") && line.ends_with(" MIT")), "{list}");
    for line in list.lines() {
        let words: Vec<_> = line.split(' ').collect();
        let is_version =
            words.get(1).is_some_and(|version| version.starts_with('v') && version.contains('.'));
        assert!(is_version && words.len() > 2 && !line.contains("(/"), "{line}");
    }
    assert!(!list.contains("profile-"), "these are of the repository");
}

/// Judged by the library of the format's makers.
#[test]
fn bill_of_materials_is_valid_and_has_each_crate_of_the_program() {
    let test = "bill_of_materials_is_valid_and_has_each_crate_of_the_program";
    let Some(package) = package(test) else { return };
    let path = package.tree.join("usr/share/doc/axisbridge/sbom.cdx.json");
    let bill: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(&path).expect("the bill")).expect("JSON");
    let list =
        fs::read_to_string(package.tree.join("usr/share/doc/axisbridge/dependencies")).expect("the list");
    let named: Vec<String> = list
        .lines()
        .map(|line| line.splitn(3, ' ').take(2).collect::<Vec<_>>().join("@").replacen("@v", "@", 1))
        .collect();
    let text = |one: &serde_json::Value, key: &str| one[key].as_str().expect("a text").to_owned();
    let components = bill["components"].as_array().expect("components");
    let own = ["mappings", "profile-cia402", "profile-cip", "profile-generic", "profile-sercos"];
    let (ours, others): (Vec<_>, Vec<_>) =
        components.iter().partition(|one| own.contains(&text(one, "name").as_str()));
    let found: Vec<String> =
        others.iter().map(|one| format!("{}@{}", text(one, "name"), text(one, "version"))).collect();
    assert_eq!((ours.len(), found.len()), (own.len(), named.len()));
    assert!(named.iter().all(|one| found.contains(one)), "{named:?} {found:?}");
    for one in others {
        assert_eq!(text(&one["hashes"][0], "content").len(), 64, "{one}");
        assert!(!text(&one["licenses"][0], "expression").contains('/'), "{one}");
    }
    let Some(python) = peer::python_or_skip(test, "cyclonedx.validation.json") else { return };
    let program = "import sys\nfrom cyclonedx.schema import SchemaVersion\n\
                   from cyclonedx.validation.json import JsonStrictValidator\n\
                   sys.exit(JsonStrictValidator(SchemaVersion.V1_5).validate_str(open(sys.argv[1]).read()))";
    success(Command::new(python).arg("-c").arg(program).arg(&path));
}

#[test]
fn manual_pages_and_completions_have_what_the_program_has() {
    let Some(package) = package("manual_pages_and_completions_have_what_the_program_has") else { return };
    let share = package.tree.join("usr/share");
    let page = success(Command::new("gzip").arg("-dc").arg(share.join("man/man1/axisbridge-run.1.gz")));
    assert!(page.contains("Record both sides to this file"), "{page}");
    let completions =
        fs::read_to_string(share.join("bash-completion/completions/axisbridge")).expect("for bash");
    assert!(completions.contains("--sync-losses"), "an option of a command in a command");
    success(Command::new("bash").arg("-n").arg(share.join("bash-completion/completions/axisbridge")));
}

#[test]
fn unit_is_the_one_that_the_documentation_shows() {
    let shipped = fs::read_to_string(Path::new(ROOT).join("packaging/axisbridge.service")).expect("the unit");
    let page = include_str!("../../../docs/tasks/run-as-a-service.md");
    let shown: String = shipped
        .lines()
        .map(|line| if line.is_empty() { "\n".to_owned() } else { format!("    {line}\n") })
        .collect();
    assert!(page.contains(&shown), "docs/tasks/run-as-a-service.md shows another unit than this:\n{shown}");
}

#[test]
fn unit_is_taken_by_systemd() {
    let test = "unit_is_taken_by_systemd";
    let Some(package) = package(test) else { return };
    if !peer::has_program("systemd-analyze") {
        peer::skip(test, "systemd-analyze (Debian package systemd)");
        return;
    }
    // The program is where it was unpacked, and its manual page is not installed.
    let program = package.tree.join("usr/bin/axisbridge");
    let text = unit(package).replace("/usr/bin/axisbridge", program.to_str().expect("a text"));
    let text: String = text
        .lines()
        .filter(|line| !line.starts_with("Documentation="))
        .map(|line| format!("{line}\n"))
        .collect();
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("package-unit");
    fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join("axisbridge.service");
    fs::write(&path, text).expect("the unit");
    let output = Command::new("systemd-analyze").arg("verify").arg(&path).output().expect("systemd-analyze");
    // It says of a key that it does not know that it ignores it, and ends well.
    assert_eq!((output.status.code(), text_of(&output)), (Some(0), String::new()));
    let mut security = Command::new("systemd-analyze");
    success(security.args(["security", "--offline=true", "--threshold=35"]).arg(&path));
}

/// Runs dpkg on a system in this folder, which has nothing else; the scripts of the package run outside of it.
fn dpkg(root: &Path, action: &str, what: &Path) -> String {
    let mut dpkg = Command::new("dpkg");
    dpkg.arg("--root").arg(root).args(["--force-script-chrootless", "--force-depends", "--force-confold"]);
    success(dpkg.arg(action).arg(what))
}

#[test]
fn package_is_installed_upgraded_and_removed_and_leaves_what_was_edited() {
    let test = "package_is_installed_upgraded_and_removed_and_leaves_what_was_edited";
    let Some(package) = package(test) else { return };
    if !rustix::process::geteuid().is_root() || !peer::has_program("systemd-sysusers") {
        peer::skip(test, "dpkg as root, and systemd-sysusers (Debian package systemd)");
        return;
    }
    let root = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("package-root");
    let _ = fs::remove_dir_all(&root);
    for folder in ["etc", "var/lib/dpkg/info", "var/lib/dpkg/updates", "var/lib/dpkg/triggers"] {
        fs::create_dir_all(root.join(folder)).expect("a folder");
    }
    fs::write(root.join("var/lib/dpkg/status"), "").expect("the list of packages");
    dpkg(&root, "--install", &package.file);

    // The user of the unit is there, and nobody can log in as it.
    assert!(unit(package).contains("\nUser=axisbridge\n"));
    let users = fs::read_to_string(root.join("etc/passwd")).expect("the users");
    let user =
        users.lines().find(|line| line.starts_with("axisbridge:")).unwrap_or_else(|| panic!("{users}"));
    assert!(user.ends_with(":/var/lib/axisbridge:/usr/sbin/nologin"), "{user}");
    // Nothing starts by itself.
    assert!(!root.join("etc/systemd").exists(), "the service is not enabled");

    let (config, kept) =
        (root.join("etc/axisbridge/gateway.toml"), root.join("var/lib/axisbridge/settings.toml"));
    fs::write(&config, edited("127.0.0.86")).expect("the configuration can be edited");
    fs::create_dir_all(kept.parent().expect("a folder")).expect("the folder of the service");
    fs::write(&kept, "").expect("settings");
    let is_edited = || fs::read_to_string(&config).is_ok_and(|text| text == edited("127.0.0.86"));
    dpkg(&root, "--install", &package.file);
    assert!(is_edited() && kept.exists(), "an upgrade keeps both");
    dpkg(&root, "--remove", Path::new("axisbridge"));
    assert!(is_edited() && kept.exists(), "a removal keeps both");
    assert!(!root.join("usr/bin/axisbridge").exists());
    dpkg(&root, "--purge", Path::new("axisbridge"));
    assert!(!config.exists() && !kept.exists(), "a purge leaves nothing");
}

/// The shipped configuration as a person edits it, for a drive in the process.
pub fn edited(address: &str) -> String {
    let shipped = include_str!("../../../packaging/gateway.toml");
    let text = shipped.replace("listen = \"CHANGE\"", &format!("listen = \"{address}\""));
    let text = text
        .replace("vendor_id = \"CHANGE\"", "vendor_id = 65_534")
        .replace("serial_number = \"CHANGE\"", "serial_number = 7");
    let text = text.replace("interface = \"CHANGE\"", "interface = \"in-process\"");
    let without_mark = |line: &str| match line.find("# CHANGE") {
        Some(at) if at > 0 => line[..at].trim_end().to_owned(),
        _ => line.to_owned(),
    };
    text.lines().map(|line| without_mark(line) + "\n").collect()
}

#[test]
fn shipped_configuration_is_refused_until_it_is_edited() {
    let Some(package) = package("shipped_configuration_is_refused_until_it_is_edited") else { return };
    let shipped = package.tree.join("etc/axisbridge/gateway.toml");
    let output =
        exec_start(package, &shipped, Path::new("/nonexistent/local")).output().expect("the program");
    let said = text_of(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    let place = |key: &str| {
        let text = include_str!("../../../packaging/gateway.toml");
        let line = text.lines().position(|line| line.starts_with(key)).expect("the key is there") + 1;
        format!("{}:{line}:", shipped.display())
    };
    for key in ["vendor_id", "serial_number"] {
        assert!(said.contains(&format!("`{key}` has the wrong type: string \"CHANGE\"")), "{said}");
        assert!(said.contains(&place(key)), "{said}");
    }
    for asked in [
        "an address of this host",
        "the network interface that the drives are on",
        "the SERCOS address of the drive",
    ] {
        assert!(said.contains(&format!("expected: {asked}")), "{asked}: {said}");
    }

    let config = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("package-edited.toml");
    fs::write(&config, edited("127.0.0.83")).expect("the configuration");
    let mut check = Command::new(package.tree.join("usr/bin/axisbridge"));
    let output = check.args(["check", "--config"]).arg(&config).output().expect("check");
    assert_eq!(
        output.status.code(),
        Some(0),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        text_of(&output)
    );
}

/// The lines of the next message, or `None` when the process has ended.
fn message(socket: &UnixDatagram, run: &mut Running) -> Option<Vec<String>> {
    let mut buffer = [0; 1024];
    let end = Instant::now() + LIMIT;
    loop {
        match socket.recv(&mut buffer) {
            Ok(len) => {
                let text = std::str::from_utf8(&buffer[..len]).expect("text");
                return Some(text.lines().map(str::to_owned).collect());
            }
            Err(_) if run.ended().is_some() => return None,
            Err(_) => assert!(Instant::now() < end, "no message within {LIMIT:?}"),
        }
    }
}

#[test]
fn service_reports_that_it_is_ready_that_its_cycle_runs_and_that_it_stops() {
    let test = "service_reports_that_it_is_ready_that_its_cycle_runs_and_that_it_stops";
    let Some(package) = package(test) else { return };
    in_real_time(test, || {
        let folder = short_folder("notify");
        let socket = UnixDatagram::bind(folder.join("notify")).expect("a socket");
        socket.set_read_timeout(Some(Duration::from_millis(100))).expect("a time-out");
        let config = folder.join("gateway.toml");
        fs::write(&config, edited("127.0.0.84")).expect("the configuration");
        let log = folder.join("log");
        let mut command = exec_start(package, &config, &folder.join("local"));
        command.env("NOTIFY_SOCKET", folder.join("notify")).env("WATCHDOG_USEC", "1000000");
        command.stdout(Stdio::null()).stderr(fs::File::create(&log).expect("the log"));
        let mut run = Running::start("service", &mut command);
        let mut seen = Vec::new();
        // The watchdog is fed again and again, and not only once at the start.
        while seen.iter().filter(|line| *line == "WATCHDOG=1").count() < 3 {
            let next = message(&socket, &mut run);
            seen.extend(
                next.unwrap_or_else(|| panic!("{seen:?}: {}", fs::read_to_string(&log).unwrap_or_default())),
            );
        }
        let ready = seen.iter().position(|line| line == "READY=1").expect("it is ready");
        let fed = seen.iter().position(|line| line == "WATCHDOG=1").expect("it feeds the watchdog");
        assert!(ready < fed, "{seen:?}");
        assert_eq!(seen.iter().filter(|line| *line == "READY=1").count(), 1, "{seen:?}");
        assert!(!seen.contains(&"STOPPING=1".to_owned()), "{seen:?}");

        let status = run.terminate(LIMIT);
        assert_eq!(status.code(), Some(0), "{}", fs::read_to_string(&log).unwrap_or_default());
        let mut last = Vec::new();
        while let Some(lines) = message(&socket, &mut run) {
            last.extend(lines);
        }
        assert!(last.contains(&"STOPPING=1".to_owned()), "{last:?}");
        fs::remove_dir_all(&folder).expect("the folder of the test");
    });
}
