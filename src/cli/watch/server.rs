//! Hands out one page over HTTP on this machine alone.

use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

use tiny_http::{Header, Request, Response};

use super::super::exit::Failure;
use crate::report::html;

/// Looks whether there is another version, and takes what is seen along to it.
const SCRIPT: &str = include_str!("watch.js");

/// The page of the latest run.
#[derive(Default)]
struct Latest {
    version: u64,
    page: String,
}

pub(super) struct Server {
    address: SocketAddr,
    latest: Arc<Mutex<Latest>>,
}

impl Server {
    /// Listens on this port, or on one that is free.
    ///
    /// # Errors
    /// [`Failure::Told`] where the port is taken.
    pub(super) fn start(port: Option<u16>) -> Result<Self, Failure> {
        let wanted = SocketAddr::from((Ipv4Addr::LOCALHOST, port.unwrap_or(0)));
        let refused = |why: String| Failure::told("no-address", format!("{wanted}: {why}"));
        let server = tiny_http::Server::http(wanted).map_err(|e| refused(e.to_string()))?;
        let address = server.server_addr().to_ip();
        let address = address.ok_or_else(|| refused("no address".into()))?;
        let latest = Arc::new(Mutex::new(Latest::default()));
        let shared = latest.clone();
        thread::spawn(move || {
            for request in server.incoming_requests() {
                // Whoever asked is gone.
                let _ = answer(request, address, &shared);
            }
        });
        let started = Self { address, latest };
        started.publish(None, (true, "the first run is under way"));
        Ok(started)
    }

    /// Where the page is.
    pub(super) fn address(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Shows another page, with messages above it, and whether all went well.
    pub(super) fn publish(&self, page: Option<String>, (well, messages): (bool, &str)) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        latest.version += 1;
        let script = SCRIPT.replace("VERSION", &latest.version.to_string());
        let role = if well { "note" } else { "alert" };
        latest.page = html::with_messages(page, (role, messages), &script);
    }
}

/// Other names of this machine are none of ours: a page elsewhere could have its own name lead here.
fn is_local(request: &Request, address: SocketAddr) -> bool {
    let host = request.headers().iter().find(|h| h.field.equiv("Host"));
    let host = host.map_or("", |header| header.value.as_str());
    host == address.to_string() || host == format!("localhost:{}", address.port())
}

fn answer(request: Request, address: SocketAddr, latest: &Mutex<Latest>) -> std::io::Result<()> {
    if !is_local(&request, address) {
        return request.respond(Response::from_string("not here\n").with_status_code(403));
    }
    let (text, kind) = {
        let latest = latest.lock().unwrap_or_else(PoisonError::into_inner);
        match request.url() {
            "/" => (latest.page.clone(), "text/html; charset=utf-8"),
            "/version" => (latest.version.to_string(), "text/plain"),
            _ => (String::new(), ""),
        }
    };
    if kind.is_empty() {
        return request.respond(Response::from_string("no such page\n").with_status_code(404));
    }
    let header = |name: &str, value: &str| Header::from_bytes(name, value).ok();
    let headers = [
        header("Content-Type", kind),
        header("Cache-Control", "no-store"),
    ];
    let mut response = Response::from_string(text);
    for header in headers.into_iter().flatten() {
        response.add_header(header);
    }
    request.respond(response)
}
