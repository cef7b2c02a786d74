//! Sessions: what a client may do after it has shown the token, until it ends the session or leaves it alone.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use rand::RngCore as _;
use rand::rngs::OsRng;
use tokio::sync::watch;

use super::hex;

/// Bytes of a key: 256 bits.
const KEY_BYTES: usize = 32;

/// Digits of a key.
const KEY_LEN: usize = 2 * KEY_BYTES;

/// Sessions at the same time.
const SESSIONS_MAX: usize = 8;

/// A session that nobody uses for so long ends.
pub const IDLE: Duration = Duration::from_secs(900);

/// Every session is in use: none can make room for another one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{SESSIONS_MAX} sessions are in use")]
pub struct TooMany;

/// The sessions of a gateway.
#[derive(Debug, Default)]
pub struct Sessions(Mutex<Vec<Session>>);

#[derive(Debug)]
struct Session {
    key: [u8; KEY_BYTES],
    host: IpAddr,
    used: Instant,
    /// Streams that use it.
    leases: usize,
    /// Dropped at the end of the session.
    open: watch::Sender<()>,
}

/// The use of a session by a stream; while there is one, the session does not end by itself.
#[derive(Debug)]
pub struct Lease {
    sessions: Arc<Sessions>,
    key: [u8; KEY_BYTES],
    open: watch::Receiver<()>,
}

impl Sessions {
    /// Opens a session for a host and returns its key. The session that was left alone for the longest time makes room.
    ///
    /// # Errors
    /// All are in use.
    pub fn open(&self, now: Instant, host: IpAddr) -> Result<String, TooMany> {
        let mut sessions = self.lock(now);
        if sessions.len() >= SESSIONS_MAX {
            let idle = sessions.iter().enumerate().filter(|(_, session)| session.leases == 0);
            let (oldest, _) = idle.min_by_key(|(_, session)| session.used).ok_or(TooMany)?;
            sessions.remove(oldest);
        }
        let mut key = [0; KEY_BYTES];
        OsRng.fill_bytes(&mut key);
        sessions.push(Session {
            key,
            host: host.to_canonical(),
            used: now,
            leases: 0,
            open: watch::channel(()).0,
        });
        Ok(hex(&key))
    }

    /// Uses a session with this key of this host; `None` without one.
    pub fn lease(self: &Arc<Self>, now: Instant, host: IpAddr, key: &str) -> Option<Lease> {
        let key = digits(key)?;
        let mut sessions = self.lock(now);
        let session = find(&mut sessions, host, &key)?;
        session.used = now;
        session.leases += 1;
        let open = session.open.subscribe();
        Some(Lease { sessions: Arc::clone(self), key, open })
    }

    /// Ends a session, and with it every stream that uses it. Whether there was one.
    pub fn close(&self, now: Instant, host: IpAddr, key: &str) -> bool {
        let Some(key) = digits(key) else { return false };
        let mut sessions = self.lock(now);
        let known = find(&mut sessions, host, &key).is_some();
        if known {
            sessions.retain(|session| session.key != key);
        }
        known
    }

    /// The sessions that have not ended by themselves.
    fn lock(&self, now: Instant) -> MutexGuard<'_, Vec<Session>> {
        let mut sessions = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        sessions.retain(|session| session.leases > 0 || now.duration_since(session.used) < IDLE);
        sessions
    }
}

/// The session with this key. Each key is compared to its end, so that the time says nothing about the keys.
fn find<'s>(sessions: &'s mut [Session], host: IpAddr, key: &[u8; KEY_BYTES]) -> Option<&'s mut Session> {
    let host = host.to_canonical();
    let mut found = None;
    for session in sessions {
        let differs = session.key.iter().zip(key).fold(0, |differs, (one, other)| differs | (one ^ other));
        if differs == 0 && session.host == host {
            found = Some(session);
        }
    }
    found
}

/// The bytes of a key.
fn digits(key: &str) -> Option<[u8; KEY_BYTES]> {
    if key.len() != KEY_LEN || !key.bytes().all(|digit| digit.is_ascii_hexdigit()) {
        return None;
    }
    let mut bytes = [0; KEY_BYTES];
    for (byte, pair) in bytes.iter_mut().zip(key.as_bytes().chunks_exact(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(bytes)
}

impl Lease {
    /// Waits until the session has ended.
    pub async fn ended(&mut self) {
        while self.open.changed().await.is_ok() {}
    }
}

impl Drop for Lease {
    fn drop(&mut self) {
        let now = Instant::now();
        let mut sessions = self.sessions.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(session) = sessions.iter_mut().find(|session| session.key == self.key) {
            session.leases = session.leases.saturating_sub(1);
            session.used = now;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOST: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(192, 0, 2, 1));
    const OTHER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(192, 0, 2, 2));

    #[test]
    fn key_is_good_for_its_host_until_the_session_ends() {
        let (sessions, now) = (Arc::new(Sessions::default()), Instant::now());
        let key = sessions.open(now, HOST).unwrap();
        assert_eq!(key.len(), 64);
        assert!(sessions.lease(now, HOST, &key).is_some());
        assert!(sessions.lease(now, "::ffff:192.0.2.1".parse().unwrap(), &key).is_some());
        assert!(sessions.lease(now, OTHER, &key).is_none(), "another host");
        for wrong in ["", &key[1..], &format!("{key}0"), &"0".repeat(64), &"+1".repeat(32)] {
            assert!(sessions.lease(now, HOST, wrong).is_none(), "{wrong}");
        }
        assert!(!sessions.close(now, OTHER, &key));
        assert!(sessions.close(now, HOST, &key));
        assert!(sessions.lease(now, HOST, &key).is_none());
    }

    #[test]
    fn session_ends_when_it_is_left_alone_and_not_while_it_is_used() {
        let (sessions, now) = (Arc::new(Sessions::default()), Instant::now());
        let key = sessions.open(now, HOST).unwrap();
        let lease = sessions.lease(now, HOST, &key).unwrap();
        assert!(sessions.lease(now + IDLE * 3, HOST, &key).is_some(), "it is used");
        drop(lease);
        // The time of a lease that ends is the present one.
        assert!(sessions.lease(now + IDLE / 2, HOST, &key).is_some());
        assert!(sessions.lease(now + IDLE * 3, HOST, &key).is_none());
    }

    #[test]
    fn oldest_session_that_is_not_used_makes_room() {
        let (sessions, now) = (Arc::new(Sessions::default()), Instant::now());
        let at = |second| now + Duration::from_secs(second);
        let keys: Vec<_> = (0..8).map(|second| sessions.open(at(second), HOST).unwrap()).collect();
        let mut leases = vec![sessions.lease(at(0), HOST, &keys[0]).unwrap()];
        let ninth = sessions.open(at(9), HOST).unwrap();
        assert!(sessions.lease(at(9), HOST, &keys[1]).is_none(), "the oldest");
        leases.extend(keys[2..].iter().chain([&ninth]).map(|key| sessions.lease(at(9), HOST, key).unwrap()));
        assert_eq!(sessions.open(at(10), HOST), Err(TooMany));
        leases.pop();
        assert!(sessions.open(at(10), HOST).is_ok());
    }

    #[tokio::test]
    async fn streams_see_the_end_of_their_session() {
        let (sessions, now) = (Arc::new(Sessions::default()), Instant::now());
        let key = sessions.open(now, HOST).unwrap();
        let mut lease = sessions.lease(now, HOST, &key).unwrap();
        let early = tokio::time::timeout(Duration::from_millis(20), lease.ended()).await;
        assert!(early.is_err(), "it is open");
        assert!(sessions.close(now, HOST, &key));
        tokio::time::timeout(Duration::from_secs(10), lease.ended()).await.expect("it has ended");
    }
}
