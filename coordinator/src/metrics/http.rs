//! The part of HTTP/1.1 that a scraper or a probe needs: one GET or HEAD per connection. Time, size and number of requests are
//! bounded, because anyone may connect.

use super::text::MEDIA_TYPE;
use crate::limits::ACCEPT_PAUSE;
use std::{io, sync::Arc, time::Duration};
use tokio::{
    io::{AsyncReadExt, AsyncWriteExt},
    net::{TcpListener, TcpStream},
    sync::Semaphore,
    time::{sleep, timeout},
};
use tracing::debug;

/// The most requests that are answered at a time; others wait in the system's queue.
const AT_A_TIME: usize = 8;
/// How long a request and its answer may take.
const REQUEST_TIME: Duration = Duration::from_secs(5);
/// The longest head of a request.
const MOST_HEAD_BYTES: usize = 8 << 10;

/// The pages that are served.
pub(super) trait Pages: Send + Sync + 'static {
    /// The metrics as of now.
    fn page(&self) -> String;

    /// The health of the run.
    ///
    /// # Errors
    /// A description of the problem.
    fn health(&self) -> Result<(), String>;
}

/// Answer requests with the current pages.
pub(super) async fn serve(listener: TcpListener, pages: impl Pages) {
    let (places, pages) = (Arc::new(Semaphore::new(AT_A_TIME)), Arc::new(pages));
    loop {
        let Ok(place) = Arc::clone(&places).acquire_owned().await else { return };
        match listener.accept().await {
            Ok((stream, _)) => {
                let pages = Arc::clone(&pages);
                tokio::spawn(async move {
                    // Errors are ignored, because only the scraper is affected.
                    let _ = timeout(REQUEST_TIME, answer(stream, &*pages)).await;
                    drop(place);
                });
            }
            Err(error) => {
                debug!(%error, "cannot accept a request for metrics");
                sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

async fn answer(mut stream: TcpStream, pages: &impl Pages) -> io::Result<()> {
    let head = read_head(&mut stream).await?;
    stream.write_all(&response(&head, pages)).await?;
    stream.shutdown().await
}

/// Read up to the empty line, or up to the bound.
async fn read_head(stream: &mut TcpStream) -> io::Result<Vec<u8>> {
    let mut head = Vec::new();
    while !head.windows(4).any(|four| four == b"\r\n\r\n") && head.len() < MOST_HEAD_BYTES {
        let mut part = [0; 1024];
        match stream.read(&mut part).await? {
            0 => break,
            read => head.extend_from_slice(&part[..read]),
        }
    }
    Ok(head)
}

/// The answer to a request with this head.
pub(super) fn response(head: &[u8], pages: &impl Pages) -> Vec<u8> {
    let line = head.split(|byte| *byte == b'\r').next().unwrap_or_default();
    let line = String::from_utf8_lossy(line);
    let words: Vec<&str> = line.split(' ').collect();
    let [method, target, version] = words[..] else {
        return message("400 Bad Request", "", "expected a request\n", true);
    };
    if !version.starts_with("HTTP/1.") {
        return message("400 Bad Request", "", "expected HTTP/1.1\n", true);
    }
    if method != "GET" && method != "HEAD" {
        return message("405 Method Not Allowed", "Allow: GET, HEAD\r\n", "expected GET\n", true);
    }
    let with_body = method == "GET";
    match target.split('?').next() {
        Some("/metrics") => message("200 OK", "", &pages.page(), with_body),
        Some("/healthz") => match pages.health() {
            Ok(()) => message("200 OK", "", "ok\n", with_body),
            Err(what) => message("503 Service Unavailable", "", &format!("{what}\n"), with_body),
        },
        _ => {
            message("404 Not Found", "", "the metrics are at /metrics, the health of the run at /healthz\n", with_body)
        }
    }
}

fn message(status: &str, header: &str, body: &str, with_body: bool) -> Vec<u8> {
    let length = body.len();
    let shown = if with_body { body } else { "" };
    let head = format!("HTTP/1.1 {status}\r\nContent-Type: {MEDIA_TYPE}\r\nContent-Length: {length}\r\n{header}");
    format!("{head}Connection: close\r\n\r\n{shown}").into_bytes()
}
