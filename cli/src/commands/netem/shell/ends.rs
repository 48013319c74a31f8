//! The two ends of a shell's network: a namespace for the command, and where its packets go.
//!
//! Each end has a TUN device; what the kernel puts into one the tunnel puts into the other. The far end is a namespace of
//! its own, or that of this process, from where the packets go on under its address (NAT).

use std::fs::File;
use std::io::{self, Error, Write};
use std::net::Ipv4Addr;
use std::os::fd::OwnedFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};

use nix::sched::{CloneFlags, setns, unshare};

use super::tun;
use crate::failure::Failure;

/// Where the kernel keeps whether it forwards packets.
const FORWARDING: &str = "/proc/sys/net/ipv4/ip_forward";
/// An empty chain in the table of each run that needs forwarding on a host where it was off: the last of them switches it off.
const WAS_OFF: &str = "mmt_forwarding_was_off";

/// Both ends; their devices and rules are gone when it is dropped.
pub(super) struct Ends {
    near: Namespace,
    far: Namespace,
    near_device: OwnedFd,
    far_device: OwnedFd,
    /// The address of the command.
    pub(super) near_ip: Ipv4Addr,
    /// The address of the other end.
    pub(super) far_ip: Ipv4Addr,
    _nat: Option<Nat>,
}

impl Ends {
    /// Makes both ends; the far one a namespace of its own, if `beside`. Without root that goes on in a user namespace.
    ///
    /// # Errors
    /// The host forbids it, or lacks a program that it takes.
    pub(super) fn make(beside: bool) -> Result<Self, Failure> {
        if !rustix::process::geteuid().is_root() {
            return Err(go_on_as_root(beside));
        }
        // networks of two runs at one time have nothing in common: 100.64.0.0/10 (RFC 6598) in blocks of four
        let number = std::process::id() % (1 << 20);
        let first = u32::from(Ipv4Addr::new(100, 64, 0, 0)) + 4 * number;
        let (far_ip, near_ip) = (Ipv4Addr::from(first + 1), Ipv4Addr::from(first + 2));
        let name = format!("mmt{number}");
        let far = if beside {
            Namespace::make().map_err(forbidden)?
        } else {
            Namespace(None)
        };
        let near = Namespace::make().map_err(forbidden)?;
        let far_device = far.within(|| tun::make(&name)).map_err(forbidden)?;
        let near_device = near.within(|| tun::make(&name)).map_err(forbidden)?;
        let route = format!("route add default via {far_ip}");
        far.within(|| set_up(&name, far_ip)).map_err(lacks_ip)?;
        near.within(|| set_up(&name, near_ip).and_then(|()| ip(&route)))
            .map_err(lacks_ip)?;
        let nat = if beside {
            None
        } else {
            let nat = Nat::set_up(&name, near_ip);
            Some(nat.map_err(|error| {
                Failure::failed(format!("no way to the host's network: {error}")).remedy(
                    "install nftables, or give --beside COMMAND for a network of two namespaces",
                )
            })?)
        };
        Ok(Self {
            near,
            far,
            near_device,
            far_device,
            near_ip,
            far_ip,
            _nat: nat,
        })
    }

    /// The near and the far device, for the tunnel.
    ///
    /// # Errors
    /// The process is out of descriptors.
    pub(super) fn interfaces(&self) -> io::Result<[OwnedFd; 2]> {
        let near = self.near_device.try_clone()?;
        Ok([near, self.far_device.try_clone()?])
    }

    /// Starts a command at the near end.
    ///
    /// # Errors
    /// It cannot be started.
    pub(super) fn at_the_near_end(&self, mut command: Command) -> io::Result<Child> {
        self.near.within(|| command.spawn())
    }

    /// Starts a command at the far end.
    ///
    /// # Errors
    /// It cannot be started.
    pub(super) fn at_the_far_end(&self, mut command: Command) -> io::Result<Child> {
        self.far.within(|| command.spawn())
    }
}

/// Starts this program again as root of a user namespace, where the way to the host's network is pasta's. Returns only if
/// that is not to be.
fn go_on_as_root(beside: bool) -> Failure {
    // pasta would only print that it failed
    if let Err(error) = tun::open() {
        return forbidden(error);
    }
    let program = std::env::current_exe();
    let program = program.unwrap_or_else(|_| "mmt".into());
    let arguments = std::env::args_os().skip(1);
    if !beside {
        let mut again = Command::new("pasta");
        again.args(["--config-net", "--quiet", "--"]).arg(program);
        let error = again.args(arguments).exec();
        let what = format!("without root there is no way to the host's network but pasta: {error}");
        return Failure::usage(what).remedy(
            "run it as root; or install pasta (passt); or give --beside COMMAND for a network of two namespaces",
        );
    }
    let namespace = ["--user", "--map-root-user"];
    let mut probe = Command::new("unshare");
    let probe = probe.args(namespace).arg("true").output();
    let no_users = |why: &str| {
        Failure::failed(format!("this host forbids user namespaces: {why}")).remedy(
            "run it as root, or allow them (sysctl kernel.unprivileged_userns_clone=1, on Ubuntu \
             kernel.apparmor_restrict_unprivileged_userns=0)",
        )
    };
    match probe {
        Err(error) => return no_users(&format!("unshare: {error}")),
        Ok(output) if !output.status.success() => {
            return no_users(String::from_utf8_lossy(&output.stderr).trim());
        }
        Ok(_) => {}
    }
    let mut again = Command::new("unshare");
    again.args(namespace).arg(program);
    let error = again.args(arguments).exec();
    no_users(&error.to_string())
}

fn forbidden(error: Error) -> Failure {
    Failure::failed(format!("this host forbids network namespaces or TUN devices: {error}")).remedy(
        "run it as root, in a container with CAP_NET_ADMIN and CAP_SYS_ADMIN; /dev/net/tun must be there \
         (mknod /dev/net/tun c 10 200) and open to this user (chmod 666 /dev/net/tun, as most hosts have it)",
    )
}

fn lacks_ip(error: Error) -> Failure {
    Failure::failed(format!(
        "the network of the namespace cannot be set up: {error}"
    ))
    .remedy("install iproute2")
}

/// Gives an interface of the namespace of this thread its address, and switches it on.
fn set_up(name: &str, address: Ipv4Addr) -> io::Result<()> {
    ip(&format!("address add {address}/30 dev {name}"))?;
    ip(&format!("link set {name} up"))?;
    ip("link set lo up")
}

/// Runs `ip` in the namespace of this thread.
fn ip(words: &str) -> io::Result<()> {
    done("ip", Command::new("ip").args(words.split(' '))).map(drop)
}

/// What a command printed.
fn done(name: &str, command: &mut Command) -> io::Result<String> {
    let output = command.output();
    let output = output.map_err(|error| Error::new(error.kind(), format!("{name}: {error}")))?;
    if output.status.success() {
        return Ok(String::from_utf8_lossy(&output.stdout).into_owned());
    }
    let printed = String::from_utf8_lossy(&output.stderr);
    Err(Error::other(format!("{name}: {}", printed.trim())))
}

/// A network namespace; none: that of this process.
struct Namespace(Option<File>);

impl Namespace {
    /// A new one, with nothing in it.
    fn make() -> io::Result<Self> {
        let file = Self(None).within(|| {
            unshare(CloneFlags::CLONE_NEWNET)?;
            File::open("/proc/thread-self/ns/net")
        })?;
        Ok(Self(Some(file)))
    }

    /// What `work` makes on a thread inside it.
    fn within<T: Send>(&self, work: impl FnOnce() -> io::Result<T> + Send) -> io::Result<T> {
        let inside = || {
            if let Some(file) = &self.0 {
                setns(file, CloneFlags::CLONE_NEWNET)?;
            }
            work()
        };
        std::thread::scope(|scope| scope.spawn(inside).join())
            .unwrap_or_else(|_| Err(Error::other("a thread panicked")))
    }
}

/// Lets the packets of the command out under the host's address; ends when dropped.
struct Nat {
    table: String,
    /// Whether forwarding was off before this run and those that overlap it.
    was_off: bool,
}

impl Nat {
    fn set_up(name: &str, near: Ipv4Addr) -> io::Result<Self> {
        let alone = alone()?;
        let off = std::fs::read_to_string(FORWARDING)?.trim() == "0";
        let nat = Self {
            table: name.to_owned(),
            was_off: off || is_on_for_others()?,
        };
        let begun = nat.begin(near);
        // who ends it waits for this
        drop(alone);
        begun.map(|()| nat)
    }

    fn begin(&self, near: Ipv4Addr) -> io::Result<()> {
        let rule = format!("ip saddr {near} masquerade");
        let chain = "type nat hook postrouting priority 100;";
        let mut nft = Command::new("nft");
        nft.args(["-f", "-"])
            .stdin(Stdio::piped())
            .stderr(Stdio::piped());
        let cannot = |error: Error| Error::new(error.kind(), format!("nft: {error}"));
        let mut child = nft.spawn().map_err(cannot)?;
        if let Some(mut stdin) = child.stdin.take() {
            let chain = format!("chain leaving {{ {chain} {rule}; }}");
            let mark = if self.was_off {
                format!("chain {WAS_OFF} {{ }}")
            } else {
                String::new()
            };
            write!(stdin, "table ip {} {{\n{chain}\n{mark}\n}}\n", self.table)?;
        }
        let output = child.wait_with_output()?;
        if !output.status.success() {
            let printed = String::from_utf8_lossy(&output.stderr);
            return Err(Error::other(format!("nft: {}", printed.trim())));
        }
        if self.was_off {
            std::fs::write(FORWARDING, "1")?;
        }
        Ok(())
    }
}

impl Drop for Nat {
    fn drop(&mut self) {
        // best effort: nobody is left to read an error
        let _alone = alone();
        let mut nft = Command::new("nft");
        let _ = done("nft", nft.args(["delete", "table", "ip", &self.table]));
        if self.was_off && matches!(is_on_for_others(), Ok(false)) {
            let _ = std::fs::write(FORWARDING, "0");
        }
    }
}

/// Keeps other runs from beginning or ending until it is dropped.
fn alone() -> io::Result<File> {
    let file = File::open(FORWARDING)?;
    file.lock()?;
    Ok(file)
}

/// Whether a run that is there has switched forwarding on.
fn is_on_for_others() -> io::Result<bool> {
    let chains = done("nft", Command::new("nft").args(["list", "chains", "ip"]))?;
    Ok(chains.contains(WAS_OFF))
}
