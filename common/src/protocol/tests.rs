use proptest::prelude::*;
use serde::{Deserialize, Serialize};

use super::*;
use crate::graph::{BlobHash, MAX_BLOB_BYTES};

const LEASE: LeaseName = LeaseName { node: 300, attempt: 2, epoch: 1 };

fn to_worker() -> Vec<ToWorker> {
    let welcome = Welcome {
        worker: 7,
        run: RunName([9; 16]),
        epoch: 1,
        heartbeat_ms: 1000,
        silence_ms: 15_000,
        drain_ms: 30_000,
    };
    let assignment = Assignment {
        lease: LEASE,
        kind: "search".into(),
        label: "search gamma 1.3".into(),
        parameters: vec![1, 2, 255],
        inputs: vec![[5; 32]],
    };
    vec![
        ToWorker::Welcome(welcome),
        ToWorker::Assign(assignment),
        ToWorker::Cancel(LEASE),
        ToWorker::Blob { hash: [5; 32], length: 70_000 },
        ToWorker::Acknowledge(LEASE),
        ToWorker::Heartbeat,
        ToWorker::Stop { reason: "the run is over".into() },
    ]
}

fn hello() -> Hello {
    Hello { build: "0.1.0".into(), threads: 4, process: 4711, name: ProcessName([3; 16]), is_local: true }
}

fn to_coordinator() -> Vec<ToCoordinator> {
    vec![
        ToCoordinator::Hello(hello()),
        ToCoordinator::Heartbeat { executing: vec![Executing { lease: LEASE, permille: 500 }] },
        ToCoordinator::Started(LEASE),
        ToCoordinator::Fetch { hash: [5; 32] },
        ToCoordinator::Finished { lease: LEASE, hash: [6; 32], length: 8 },
        ToCoordinator::Failed { lease: LEASE, kind: FailureKind::Application, message: "no".into() },
        ToCoordinator::Failed { lease: LEASE, kind: FailureKind::Panic, message: "index 7 of 7".into() },
        ToCoordinator::Failed { lease: LEASE, kind: FailureKind::UnknownKind, message: "nonsense".into() },
        ToCoordinator::Goodbye,
        ToCoordinator::Draining,
    ]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn secret(byte: u8) -> Secret {
    Secret::from_bytes([byte; 32])
}

/// The key of a secret on one and the same connection.
fn key(byte: u8) -> ProofKey {
    key_on(byte, 5)
}

fn key_on(byte: u8, channel: u8) -> ProofKey {
    ProofKey::new(&secret(byte), &ChannelBinding::from_exporter([channel; 32]))
}

#[test]
fn message_bytes_belong_to_this_protocol_version() {
    let encoded: Vec<u8> = to_worker()
        .iter()
        .map(|message| encode_message(message).unwrap())
        .chain(to_coordinator().iter().map(|message| encode_message(message).unwrap()))
        .flat_map(|bytes| [vec![u8::try_from(bytes.len()).unwrap()], bytes].concat())
        .collect();
    // If this fails, the protocol has changed: increment PROTOCOL_VERSION and write the new hash here.
    let golden = (5, "8a654160e73aab518e3039e1a3f39af290d64a27a01ee9e01bd094381322d4e7");
    assert_eq!((PROTOCOL_VERSION, BlobHash::of(&encoded).to_string().as_str()), golden);
}

#[test]
fn lease_and_hello_have_their_golden_bytes() {
    let hello = ToCoordinator::Hello(hello());
    // Variant 0; five characters; 4; 251 announces two bytes of 4711; the name; true.
    assert_eq!(hex(&encode_message(&hello).unwrap()), "0005302e312e3004fb67120303030303030303030303030303030301");
    assert_eq!(hex(&encode_message(&ToWorker::Cancel(LEASE)).unwrap()), "02fb2c010201");
    assert_eq!(hex(&frame_header(FrameTag::Part, 259).unwrap()), "0401000001");
}

#[test]
fn every_message_round_trips_and_truncated_ones_are_refused() {
    fn check<T: Serialize + for<'de> Deserialize<'de> + PartialEq + std::fmt::Debug>(messages: Vec<T>) {
        for message in messages {
            let bytes = encode_message(&message).unwrap();
            assert_eq!(decode_message::<T>(&bytes).unwrap(), message);
            for cut in 0..bytes.len() {
                assert!(decode_message::<T>(&bytes[..cut]).is_err(), "{message:?} cut to {cut} bytes");
            }
            let longer = [bytes.as_slice(), &[0]].concat();
            assert!(matches!(decode_message::<T>(&longer), Err(CodecError::Trailing { .. })));
        }
    }
    check(to_worker());
    check(to_coordinator());
}

#[test]
fn hostile_lengths_inside_a_message_are_refused_before_allocation() {
    // `Stop` with a text of 2^64 - 1 bytes, `Assign` with as many parameters, an unknown variant.
    for hostile in
        [[vec![6, 253], vec![255; 8]].concat(), [vec![1, 1, 1, 1, 0, 0, 253], vec![255; 8]].concat(), vec![99], vec![]]
    {
        assert!(matches!(decode_message::<ToWorker>(&hostile), Err(CodecError::Decode { .. })), "{hostile:?}");
    }
    let long = ToWorker::Stop { reason: "x".repeat(MAX_FRAME_BYTES) };
    assert!(matches!(encode_message(&long), Err(CodecError::TooLong { .. })));
}

#[test]
fn payload_floats_keep_their_bits() {
    let values = vec![0.1_f64, -0.0, f64::MIN_POSITIVE / 3.0, f64::INFINITY, f64::from_bits(0x7ff8_0000_dead_beef)];
    let decoded: Vec<f64> = decode(&encode(&values).unwrap()).unwrap();
    let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&decoded), bits(&values));
}

#[test]
fn frames_are_found_for_any_split_of_the_stream() {
    let large = vec![3; MAX_FRAME_BYTES - 1];
    let bodies: [(FrameTag, &[u8]); 4] =
        [(FrameTag::Message, b"first"), (FrameTag::Part, b""), (FrameTag::Part, &large), (FrameTag::Message, b"last")];
    let stream: Vec<u8> = bodies
        .iter()
        .flat_map(|(tag, body)| [frame_header(*tag, body.len()).unwrap().as_slice(), body].concat())
        .collect();
    for step in [1009, 65536, stream.len()] {
        let mut reader = FrameReader::default();
        let mut frames = Vec::new();
        for piece in stream.chunks(step) {
            reader.push(piece);
            while let Some(frame) = reader.next_frame().unwrap() {
                frames.push(frame);
            }
        }
        let found: Vec<_> = frames.iter().map(|frame| (frame.tag, frame.body.as_slice())).collect();
        assert!(found == bodies, "{} frames in steps of {step}", found.len());
        assert!(reader.is_between_frames());
    }
}

#[test]
fn frame_of_bad_length_or_tag_is_refused_from_its_header_alone() {
    let first = |bytes: &[u8]| {
        let mut reader = FrameReader::default();
        reader.push(bytes);
        reader.next_frame()
    };
    assert_eq!(first(&[0, 0, 0, 0, 0]), Err(FrameError::Length { found: 0, limit: MAX_FRAME_BYTES }));
    assert_eq!(
        first(&[1, 0, 0x20, 0, 0]),
        Err(FrameError::Length { found: MAX_FRAME_BYTES + 1, limit: MAX_FRAME_BYTES })
    );
    assert_eq!(first(&[255; 5]), Err(FrameError::Length { found: u32::MAX as usize, limit: MAX_FRAME_BYTES }));
    assert_eq!(first(b"GET / HTTP/1.1"), Err(FrameError::Length { found: 0x2054_4547, limit: MAX_FRAME_BYTES }));
    assert_eq!(first(&[1, 0, 0, 0, 2]), Err(FrameError::Tag { found: 2 }));
    assert_eq!(first(&[0, 0, 0x20, 0]), Ok(None));
    let mut reader = FrameReader::with_limit(100);
    reader.push(&[101, 0, 0, 0, 0]);
    assert_eq!(reader.next_frame(), Err(FrameError::Length { found: 101, limit: 100 }));
    assert!(frame_header(FrameTag::Part, MAX_FRAME_BYTES).is_err());
}

#[test]
fn both_sides_prove_the_secret_to_each_other() {
    let challenge = Challenge::from_bytes(&Challenge::new([1; 32]).to_bytes()).unwrap();
    let answer = challenge.answer(&key(7), [2; 32]).unwrap();
    let response = Response::from_bytes(&answer.to_bytes()).unwrap();
    let verdict = Verdict::from_bytes(&response.judge(&challenge, &key(7)).to_bytes()).unwrap();
    assert_eq!(verdict.check(&challenge, &response, &key(7)), Ok(()));
    assert_ne!(verdict.proof, response.proof);
    // An impostor accepts anyone, but cannot prove that it knows the secret.
    assert_eq!(verdict.check(&challenge, &response, &key(8)), Err(HandshakeError::Impostor));
}

#[test]
fn wrong_secret_is_refused_without_a_proof() {
    let challenge = Challenge::new([1; 32]);
    let response = challenge.answer(&key(8), [2; 32]).unwrap();
    let verdict = response.judge(&challenge, &key(7));
    assert_eq!(verdict.proof, [0; 32]);
    let verdict = Verdict::from_bytes(&verdict.to_bytes()).unwrap();
    let refused = HandshakeError::Refused(Refusal::WrongSecret);
    assert_eq!(verdict.check(&challenge, &response, &key(8)), Err(refused));
    // A proof for another challenge is refused.
    let replayed = Challenge::new([3; 32]).answer(&key(7), [2; 32]).unwrap();
    assert_eq!(replayed.judge(&challenge, &key(7)).refusal, Some(Refusal::WrongSecret));
}

#[test]
fn proofs_cannot_be_relayed_to_another_connection() {
    let challenge = Challenge::new([1; 32]);
    // A man in the middle has a connection to each side and relays everything.
    let response = challenge.answer(&key_on(7, 1), [2; 32]).unwrap();
    let verdict = response.judge(&challenge, &key_on(7, 2));
    assert_eq!((verdict.refusal, verdict.proof), (Some(Refusal::WrongSecret), [0; 32]));
    let accepted = challenge.answer(&key_on(7, 2), [2; 32]).unwrap().judge(&challenge, &key_on(7, 2));
    assert_eq!(accepted.check(&challenge, &response, &key_on(7, 1)), Err(HandshakeError::Impostor));
    assert!(!format!("{:?} {:?}", key_on(7, 1), ChannelBinding::from_exporter([77; 32])).contains('7'));
}

#[test]
fn unknown_version_is_named_on_both_sides() {
    let strange = Challenge { version: 9, nonce: [1; 32] };
    let error = strange.answer(&key(7), [2; 32]).unwrap_err();
    assert_eq!(error, HandshakeError::Version { expected: PROTOCOL_VERSION, found: 9 });
    let challenge = Challenge::new([1; 32]);
    let mut response = challenge.answer(&key(7), [2; 32]).unwrap();
    response.version = 9;
    assert_eq!(response.judge(&challenge, &key(7)).refusal, Some(Refusal::WrongVersion));
}

#[test]
fn preamble_has_its_golden_bytes_and_refuses_other_protocols() {
    let challenge = Challenge::new([1; 32]);
    let ones = "01".repeat(32);
    assert_eq!(hex(&challenge.to_bytes()), format!("4c4f4f4b4c494b4505000000{ones}"));
    let response = challenge.answer(&key(7), [2; 32]).unwrap();
    let twos = "02".repeat(32);
    let proof = "1a377a2bf07122db57439a15bbd04df8a1872c437783d1da1eafd1103358f852";
    assert_eq!(hex(&response.to_bytes()), format!("4c4f4f4b4c494b4505000000{twos}{proof}"));
    assert_eq!(Challenge::from_bytes(&[b'H'; CHALLENGE_BYTES]), Err(HandshakeError::Magic));
    assert_eq!(Response::from_bytes(&[0; RESPONSE_BYTES]), Err(HandshakeError::Magic));
    let mut verdict = response.judge(&challenge, &key(7)).to_bytes();
    verdict[10] = 77;
    assert_eq!(Verdict::from_bytes(&verdict), Err(HandshakeError::Verdict { found: 77 }));
}

#[test]
fn blob_arrives_in_parts_and_is_verified() {
    let bytes: Vec<u8> = (0..=250_u8).cycle().take(2 * PART_BYTES + 5).collect();
    let mut incoming = IncomingBlob::begin(BlobHash::of(&bytes), bytes.len() as u64).unwrap();
    assert_eq!(parts(&bytes).count(), 3);
    for part in parts(&bytes) {
        assert!(!incoming.is_complete());
        incoming.push(part).unwrap();
    }
    assert_eq!(incoming.push(&[0]), Err(TransferError::Part { expected: 0, found: 1 }));
    assert_eq!(incoming.finish().unwrap().hash(), BlobHash::of(&bytes));
    assert!(IncomingBlob::begin(BlobHash::of(b""), 0).unwrap().finish().unwrap().is_empty());
}

#[test]
fn transfer_of_wrong_length_or_content_is_refused() {
    let hash = BlobHash::of(b"four");
    let too_long = TransferError::TooLong { found: MAX_BLOB_BYTES as u64 + 1 };
    assert_eq!(IncomingBlob::begin(hash, MAX_BLOB_BYTES as u64 + 1).unwrap_err(), too_long);
    let mut incoming = IncomingBlob::begin(hash, 4).unwrap();
    assert_eq!(incoming.push(b""), Err(TransferError::Part { expected: 4, found: 0 }));
    assert_eq!(incoming.push(b"fives"), Err(TransferError::Part { expected: 4, found: 5 }));
    incoming.push(b"for").unwrap();
    assert!(incoming.finish().is_err());
    let mut incoming = IncomingBlob::begin(hash, 4).unwrap();
    incoming.push(b"Four").unwrap();
    assert!(matches!(incoming.finish(), Err(TransferError::Hash(_))));
}

#[test]
fn access_file_round_trips_and_hides_its_secret() {
    let certificate = CertificatePin::of(b"certificate");
    let access = Access { address: "[::1]:4000".into(), certificate, secret: secret(0xab) };
    assert_eq!(Access::parse(&access.to_json()).unwrap(), access);
    assert!(access.to_json().contains(&"ab".repeat(32)));
    assert!(!format!("{access:?}").contains("abab"));
    assert!(certificate.names(b"certificate") && !certificate.names(b"another"));
}

#[test]
fn bad_access_files_are_named_without_repeating_the_secret() {
    let (digits, pin) = ("ab".repeat(32), format!("\"blake3:{}\"", "cd".repeat(32)));
    let file = |address: &str, certificate: &str, secret: &str| {
        Access::parse(&format!(r#"{{"address": "{address}", "certificate": {certificate}, "secret": "{secret}"}}"#))
    };
    assert!(file("h:1", &pin, &digits).is_ok());
    assert!(matches!(file("host", &pin, &digits), Err(AccessError::Address { .. })));
    assert!(matches!(file("host:70000", &pin, &digits), Err(AccessError::Address { .. })));
    assert_eq!(file("h:1", &pin, "abc"), Err(AccessError::Secret { found: 3 }));
    assert_eq!(file("h:1", &pin, &"g".repeat(64)), Err(AccessError::Secret { found: 64 }));
    // Every connection uses TLS, so the pin is required.
    for certificate in ["null", "\"\"", "\"pem\"", &format!("\"sha256:{digits}\""), &format!("\"blake3:{digits}00\"")] {
        assert_eq!(file("h:1", certificate, &digits), Err(AccessError::Certificate), "{certificate}");
    }
    let misplaced = Access::parse(&format!(r#"{{"address": "h:1", "certificate": {pin}, "secret": ["{digits}"]}}"#));
    assert!(!misplaced.unwrap_err().to_string().contains(&digits));
    let swapped = file("h:1", &format!("\"{digits}\""), &digits).unwrap_err();
    assert!(!swapped.to_string().contains(&digits));
    assert!(matches!(Access::parse("{"), Err(AccessError::Json(_))));
}

#[test]
fn long_text_is_cut_at_a_character() {
    let text = format!("a{}", "é".repeat(MAX_MESSAGE_TEXT_BYTES));
    let cut = bounded_text(&text);
    assert_eq!(cut.len(), MAX_MESSAGE_TEXT_BYTES - 1);
    assert!(text.starts_with(&cut));
    assert_eq!(bounded_text("short"), "short");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn arbitrary_bytes_are_refused_or_understood_but_never_panic(
        bytes in prop::collection::vec(any::<u8>(), 0..300),
        variant in 0..9_u8,
        cut in 1..300_usize,
    ) {
        // The first byte is the variant: most random messages would fail on it alone.
        let message = [&[variant], bytes.as_slice()].concat();
        if let Ok(understood) = decode_message::<ToWorker>(&message) {
            prop_assert_eq!(decode_message::<ToWorker>(&encode_message(&understood).unwrap()).unwrap(), understood);
        }
        if let Ok(understood) = decode_message::<ToCoordinator>(&message) {
            prop_assert_eq!(decode_message::<ToCoordinator>(&encode_message(&understood).unwrap()).unwrap(), understood);
        }
        let _ = decode::<Vec<(String, f64)>>(&bytes);
        let _ = Access::parse(&String::from_utf8_lossy(&bytes));
        let mut reader = FrameReader::default();
        for piece in bytes.chunks(cut) {
            reader.push(piece);
            while let Ok(Some(frame)) = reader.next_frame() {
                prop_assert!(frame.body.len() < MAX_FRAME_BYTES);
            }
        }
    }
}
