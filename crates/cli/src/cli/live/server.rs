//! A small server of HTTP on the loopback address, for one page and what it asks for.
//!
//! Each connection has a thread of its own, a few at a time, and carries one request with a limit on its length and its time: a slow or
//! broken client holds up nobody. All but the page itself needs the token, which the address holds behind `#`, so that browsers do not
//! send it on; a request for another host than this machine is refused, whatever name leads here.

use std::io::{self, Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use turbid::memory;

/// Header that holds the token.
pub(super) const TOKEN: &str = "X-Turbid-Token";
/// Longest head of a request (bytes).
const HEAD: usize = 8 << 10;
/// Most headers of a request.
const HEADERS: usize = 64;
/// Connections at a time; further ones are closed.
const CONNECTIONS: usize = 16;
/// Time for a request, and for its answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// Time for a client to close the connection.
const LINGER: Duration = Duration::from_secs(1);
/// Bytes that are written at once.
const CHUNK: usize = 64 << 10;

/// An answer.
pub(super) struct Answer {
    pub(super) status: u16,
    /// Media type.
    pub(super) kind: &'static str,
    pub(super) body: Vec<u8>,
}

impl Answer {
    pub(super) fn new(kind: &'static str, body: impl Into<Vec<u8>>) -> Self {
        Self { status: 200, kind, body: body.into() }
    }

    /// A refusal in words.
    pub(super) fn refusal(status: u16, words: &str) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", body: words.into() }
    }
}

/// Answers requests for a path with a method, `"GET"` or `"POST"`.
pub(super) trait Site: Send + Sync + 'static {
    /// The page at `/`, which anyone on this machine may read.
    fn page(&self) -> String;
    /// All other paths, with the token.
    fn answer(&self, method: &str, path: &str) -> Answer;
}

/// A bound port and the token of its requests.
pub(super) struct Server {
    listener: TcpListener,
    token: String,
}

impl Server {
    /// Binds a port of the loopback address; 0 is any that is free.
    pub(super) fn bind(port: u16) -> io::Result<Self> {
        let mut random = [0_u8; 16];
        getrandom::fill(&mut random).map_err(|error| io::Error::other(error.to_string()))?;
        let token = format!("{:032x}", u128::from_ne_bytes(random));
        Ok(Self { listener: TcpListener::bind((Ipv4Addr::LOCALHOST, port))?, token })
    }

    /// The address to open, with the token.
    pub(super) fn address(&self) -> io::Result<String> {
        Ok(format!("http://{}/#{}", self.listener.local_addr()?, self.token))
    }

    /// Serves as long as the process lives.
    pub(super) fn serve(self, site: &Arc<impl Site>) {
        let (token, open) = (Arc::new(self.token), Arc::new(AtomicUsize::new(0)));
        for stream in self.listener.incoming() {
            let Ok(stream) = stream else {
                // Too many open files, for example.
                thread::sleep(Duration::from_millis(100));
                continue;
            };
            if open.fetch_add(1, Ordering::Relaxed) >= CONNECTIONS {
                open.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let one = Counted(Arc::clone(&open));
            let (site, token) = (Arc::clone(site), Arc::clone(&token));
            let work = move |starting| {
                drop(starting);
                let _one = one;
                // A client that is gone misses nothing.
                let _ = converse(stream, &token, &*site);
            };
            let thread = thread::Builder::new().name("page".to_string());
            let _ = memory::start_thread(|starting| thread.spawn(|| work(starting)));
        }
    }
}

/// A connection that is open.
struct Counted(Arc<AtomicUsize>);

impl Drop for Counted {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// Reads a request and answers it.
fn converse(mut stream: TcpStream, token: &str, site: &impl Site) -> io::Result<()> {
    let end = Instant::now() + PATIENCE;
    let mut head = Vec::new();
    let answer = loop {
        if let Some(answer) = answer(&head, token, site) {
            break answer;
        }
        if head.len() >= HEAD {
            break Answer::refusal(431, "the request is too long");
        }
        stream.set_read_timeout(Some(left(end)?))?;
        let mut part = [0; 1024];
        match stream.read(&mut part)? {
            0 => return Ok(()),
            length => head.extend_from_slice(&part[..length]),
        }
    };
    write(&mut stream, &answer)?;
    // What is still on its way must not reset the connection before the answer is read.
    stream.shutdown(Shutdown::Write)?;
    drain(&mut stream, Instant::now() + LINGER)
}

/// Reads what is still on its way, up to [`CHUNK`], until the client closes the connection or the time is over.
fn drain(stream: &mut TcpStream, end: Instant) -> io::Result<()> {
    let (mut part, mut length) = ([0; 1024], 0);
    while length < CHUNK {
        stream.set_read_timeout(Some(left(end)?))?;
        match stream.read(&mut part)? {
            0 => break,
            more => length += more,
        }
    }
    Ok(())
}

/// Writes all bytes, or fails when the time is over, however slowly a client takes them.
fn send(stream: &mut TcpStream, mut bytes: &[u8], end: Instant) -> io::Result<()> {
    while !bytes.is_empty() {
        stream.set_write_timeout(Some(left(end)?))?;
        match stream.write(&bytes[..bytes.len().min(CHUNK)])? {
            0 => return Err(io::ErrorKind::WriteZero.into()),
            length => bytes = &bytes[length..],
        }
    }
    Ok(())
}

fn left(end: Instant) -> io::Result<Duration> {
    let left = end.saturating_duration_since(Instant::now());
    if left.is_zero() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(left) }
}

fn write(stream: &mut TcpStream, answer: &Answer) -> io::Result<()> {
    let end = Instant::now() + PATIENCE;
    let reason = match answer.status {
        200 => "OK",
        403 => "Forbidden",
        404 => "Not Found",
        431 => "Request Header Fields Too Large",
        _ => "Bad Request",
    };
    let head = format!(
        "HTTP/1.1 {} {reason}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\nX-Frame-Options: DENY\r\nCross-Origin-Resource-Policy: same-origin\r\n\r\n",
        answer.status,
        answer.kind,
        answer.body.len()
    );
    send(stream, head.as_bytes(), end)?;
    send(stream, &answer.body, end)
}

/// The answer to a request that begins so; none if more of it is to come.
fn answer(head: &[u8], token: &str, site: &impl Site) -> Option<Answer> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(head) {
        Ok(httparse::Status::Complete(_)) => {}
        Ok(httparse::Status::Partial) => return None,
        Err(_) => return Some(Answer::refusal(400, "this is not a request of HTTP")),
    }
    let value = |name: &str| {
        let mut all = request.headers.iter().filter(|header| header.name.eq_ignore_ascii_case(name));
        let first = all.next()?;
        all.next().is_none().then_some(first.value)
    };
    if !value("Host").is_some_and(is_here) {
        return Some(Answer::refusal(403, "this host is not here"));
    }
    let (method, path) = (request.method?, request.path?);
    let path = path.split('?').next().unwrap_or(path);
    if (method, path) == ("GET", "/") {
        return Some(Answer::new("text/html; charset=utf-8", site.page()));
    }
    if !value(TOKEN).is_some_and(|given| is_same(given, token.as_bytes())) {
        return Some(Answer::refusal(
            403,
            "the token is missing or wrong: open the address that the program has printed",
        ));
    }
    Some(site.answer(method, path))
}

/// True of names of this machine, with any port: a tunnel may lead here.
fn is_here(host: &[u8]) -> bool {
    let name = host.rsplitn(2, |&byte| byte == b':').last().unwrap_or(host);
    name.eq_ignore_ascii_case(b"localhost") || name == b"127.0.0.1"
}

/// Compares in a time that does not depend on where the difference is.
fn is_same(given: &[u8], token: &[u8]) -> bool {
    given.len() == token.len() && given.iter().zip(token).fold(0, |all, (a, b)| all | (a ^ b)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Echo;

    impl Site for Echo {
        fn page(&self) -> String {
            "page".to_string()
        }
        fn answer(&self, method: &str, path: &str) -> Answer {
            Answer::new("text/plain", format!("{method} {path}"))
        }
    }

    fn asked(head: &str) -> Option<(u16, String)> {
        let answer = answer(head.as_bytes(), "secret", &Echo)?;
        Some((answer.status, String::from_utf8(answer.body).unwrap()))
    }

    #[test]
    fn only_the_page_needs_no_token_and_only_this_machine_is_answered() {
        let status = |head: &str| asked(head).map(|(status, _)| status);
        assert_eq!(asked("GET / HTTP/1.1\r\nHost: localhost:80\r\n\r\n"), Some((200, "page".into())));
        assert_eq!(status("GET / HTTP/1.1\r\nHost: evil.example:80\r\n\r\n"), Some(403));
        assert_eq!(status("GET / HTTP/1.1\r\nHost: 127.0.0.1.evil.example\r\n\r\n"), Some(403));
        assert_eq!(status("GET / HTTP/1.1\r\n\r\n"), Some(403));
        assert_eq!(status("GET / HTTP/1.1\r\nHost: localhost\r\nHost: evil\r\n\r\n"), Some(403));
        let post = |token: &str| {
            format!("POST /stop?x HTTP/1.1\r\nhost: 127.0.0.1:9\r\nx-turbid-token: {token}\r\n\r\n")
        };
        assert_eq!(asked(&post("secret")), Some((200, "POST /stop".into())));
        for wrong in ["", "secreu", "secret2", "secre"] {
            assert_eq!(status(&post(wrong)), Some(403), "{wrong}");
        }
        assert_eq!(status("POST /stop HTTP/1.1\r\nHost: localhost\r\n\r\n"), Some(403));
    }

    #[test]
    fn a_client_that_keeps_the_connection_open_is_left_at_the_deadline() {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
        let mut client = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        let (mut stream, _) = listener.accept().unwrap();
        client.write_all(b"x").unwrap();
        let is_late = |done: io::Result<()>| done.is_err_and(|error| error.kind() == io::ErrorKind::TimedOut);
        assert!(is_late(drain(&mut stream, Instant::now())));
        assert!(is_late(send(&mut stream, b"x", Instant::now())));
    }

    #[test]
    fn garbage_is_refused_and_half_a_request_waits() {
        assert_eq!(asked("\0\u{1}\r\n\r\n").map(|(status, _)| status), Some(400));
        assert_eq!(asked("GET / HTTP/1.1\r\nHost: loc"), None);
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "A: b\r\n".repeat(HEADERS + 1));
        assert_eq!(asked(&many).map(|(status, _)| status), Some(400));
    }
}
