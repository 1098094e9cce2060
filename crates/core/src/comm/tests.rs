use super::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// The contract, on any transport.
fn contract(comm: &Comm) {
    let (rank, size) = (comm.rank(), comm.size());
    let mut sums = [1, rank as i64, i64::MAX];
    comm.sum(&mut sums);
    let n = size as i64;
    assert_eq!(sums, [n, n * (n - 1) / 2, i64::MAX.wrapping_mul(n)]);
    assert!(comm.any(rank == size - 1) && !comm.any(false));
    let mut most = [rank as f64, -(rank as f64)];
    comm.max(&mut most);
    assert_eq!(most.map(|x| x as i64), [n - 1, 0]);
    let all = comm.all_gather(vec![rank as u8; rank]);
    assert!(all.iter().enumerate().all(|(r, bytes)| *bytes == vec![r as u8; r]) && all.len() == size);
    let gathered = comm.gather(vec![7, rank as u8]);
    assert_eq!(gathered.len(), if rank == 0 { size } else { 0 });
    assert!(gathered.iter().enumerate().all(|(r, bytes)| *bytes == [7, r as u8]));
    for round in 0..3 {
        // To those of whose rank the own one is a multiple, itself and rank 0 included.
        let to = |other: &usize| if *other == 0 { true } else { rank.is_multiple_of(*other) };
        let message = |other: usize| (other, vec![(rank + round) as u8; rank + other]);
        let received = comm.route((0..size).rev().filter(to).map(message).collect());
        let from = |other: &usize| rank == 0 || other.is_multiple_of(rank);
        let due = (0..size).filter(from).map(|other| (other, vec![(other + round) as u8; rank + other]));
        assert!(received.into_iter().eq(due), "round {round}");
    }
    let peers: Vec<usize> = (0..size).filter(|&p| p != rank).collect();
    for round in 0..50_usize {
        let messages = peers.iter().map(|&p| vec![(rank * 16 + p) as u8; round % 3 * p]).collect();
        for (&peer, got) in peers.iter().zip(comm.exchange(&peers, messages)) {
            assert_eq!(got, vec![(peer * 16 + rank) as u8; round % 3 * rank]);
        }
    }
    for round in 0..3 {
        let shared = comm.share(Arc::new(10 * rank + round));
        assert_eq!(shared.is_some(), comm.ranks_per_process() == size);
        let all = shared.map(|all| all.iter().map(|value| **value).collect::<Vec<_>>());
        assert!(all.is_none_or(|all| all == (0..size).map(|r| 10 * r + round).collect::<Vec<_>>()));
    }
    let everybody: Vec<usize> = (0..size).collect();
    // The longest are too long for MPI to send before the receiver is ready.
    let lengths: Vec<usize> =
        everybody.iter().map(|&p| 3 + 40_000 * usize::from(p + rank == 1) + p + rank).collect();
    let (mut a, mut b) =
        (comm.halo::<f32>(&everybody, &lengths).unwrap(), comm.halo::<f64>(&everybody, &lengths).unwrap());
    for round in 0..100_u16 {
        for &peer in &everybody {
            a.send(peer).fill(f32::from(round) + peer as f32);
            b.send(peer).fill(f64::from(round) - rank as f64);
        }
        // Both under way at once, while other messages travel and this rank works.
        a.start();
        let mut ranks = [1];
        comm.sum(&mut ranks);
        b.start();
        for _ in 0..round % 4 {
            a.progress();
            b.progress();
        }
        let posted = comm.exchange(&peers, peers.iter().map(|&p| vec![p as u8; p]).collect());
        assert!(posted.iter().all(|got| *got == vec![rank as u8; rank]));
        if round % 2 == 0 {
            a.finish();
        }
        b.finish();
        if round % 2 == 1 {
            a.finish();
        }
        assert_eq!(ranks, [n]);
        for &peer in &everybody {
            assert_eq!(a.received(peer), vec![f32::from(round) + rank as f32; lengths[peer]]);
            assert_eq!(b.received(peer), vec![f64::from(round) - peer as f64; lengths[peer]]);
        }
    }
    // A pattern that is given up on its way leaves others alone.
    let mut given_up = comm.halo::<f32>(&everybody, &lengths).unwrap();
    given_up.start();
    given_up.progress();
    drop(given_up);
    a.exchange();
    comm.barrier();
}

/// Every call once, and its counts.
fn traffic(comm: &Comm) {
    let (rank, size) = (comm.rank(), comm.size());
    let all: Vec<usize> = (0..size).collect();
    let others: Vec<usize> = (0..size).filter(|&p| p != rank).collect();
    let before = comm.traffic();
    let mut pattern = comm.halo::<f64>(&all, &vec![10; size]).unwrap();
    assert_eq!(comm.traffic() - before, Traffic::default());
    pattern.exchange();
    pattern.exchange();
    comm.exchange(&others, others.iter().map(|&p| vec![0; p]).collect());
    comm.sum(&mut [1, 2]);
    comm.max(&mut [1.0]);
    comm.any(false);
    comm.all_gather(vec![0; 5]);
    comm.gather(vec![0; 7]);
    comm.barrier();
    let traffic = comm.traffic() - before;
    let count = |tally: Tally| [tally.messages, tally.bytes].map(|n| n as usize);
    assert_eq!(count(traffic.halo), [2 * others.len(), 160 * others.len()]);
    assert_eq!(count(traffic.exchange), [others.len(), others.iter().sum()]);
    let calls = if size > 1 { [6, 16 + 8 + 8 + 5 + 7] } else { [0, 0] };
    assert_eq!(count(traffic.collective), calls);
}

#[test]
fn every_message_to_another_rank_is_counted_once_with_its_bytes_on_1_to_4_ranks() {
    traffic(&Comm::Solo);
    for ranks in 2..=4 {
        on_threads(ranks, |comm| traffic(&comm));
    }
}

#[test]
fn the_time_of_waiting_for_a_late_rank_is_counted_on_2_ranks() {
    let begun = AtomicBool::new(false);
    let waited = on_threads(2, |comm| {
        let mut pattern = comm.halo::<f32>(&[1 - comm.rank()], &[4]).unwrap();
        if comm.rank() == 0 {
            begun.store(true, Ordering::Release);
        } else {
            while !begun.load(Ordering::Acquire) {
                std::thread::yield_now();
            }
            std::thread::sleep(Duration::from_millis(150));
        }
        pattern.exchange();
        comm.traffic().halo.seconds
    });
    // Less than the delay, for the machine may be busy.
    assert!(waited[0] > 0.05, "{waited:?}");
}

#[test]
fn the_only_rank_keeps_the_contract() {
    contract(&Comm::Solo);
}

#[test]
fn one_to_eight_thread_ranks_keep_the_contract() {
    for ranks in 1..=8 {
        on_threads(ranks, |comm| contract(&comm));
    }
}

/// Runs a test of this program that is ignored, on the ranks of an MPI job; the output and whether it passed.
#[cfg(feature = "mpi")]
fn under_mpirun(ranks: usize, test: &str) -> (bool, String) {
    let output = std::process::Command::new("timeout")
        .args(["--kill-after=5", "60", "mpirun", "-n", &ranks.to_string()])
        .arg(std::env::current_exe().unwrap())
        .args([test, "--exact", "--ignored", "--nocapture"])
        .envs([
            ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
            ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
            ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
            ("OMPI_MCA_mpi_yield_when_idle", "1"),
            ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        ])
        .output()
        .expect("mpirun and timeout are there");
    let said = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    (output.status.success(), said.concat())
}

#[cfg(feature = "mpi")]
#[test]
#[ignore = "a rank of the test below"]
fn as_an_mpi_rank() {
    // Two runs of one process, one after the other.
    contract(&Comm::Mpi(MpiComm::world()));
    contract(&Comm::Mpi(MpiComm::world()));
    // Gathered data travel in many pieces.
    contract(&Comm::Mpi(MpiComm::world().with_limit(1)));
    let comm = Comm::Mpi(MpiComm::world());
    if comm.size() > 1 {
        traffic(&comm);
    }
}

#[cfg(feature = "mpi")]
#[test]
fn one_to_four_mpi_ranks_keep_the_contract() {
    for ranks in 1..=4 {
        let (passed, said) = under_mpirun(ranks, "comm::tests::as_an_mpi_rank");
        assert!(passed, "{ranks} ranks: {said}");
        assert_eq!(said.matches("1 passed").count(), ranks, "{said}");
    }
}

#[cfg(feature = "mpi")]
#[test]
#[ignore = "a rank of the test below"]
fn as_an_mpi_rank_that_panics() {
    let comm = Comm::Mpi(MpiComm::world());
    assert!(comm.rank() != 1, "the words of the rank that panics");
    comm.barrier();
}

#[cfg(feature = "mpi")]
#[test]
fn a_panicking_mpi_rank_ends_the_job_with_its_own_words() {
    let (passed, said) = under_mpirun(3, "comm::tests::as_an_mpi_rank_that_panics");
    assert!(!passed && said.contains("the words of the rank that panics"), "{said}");
}

#[test]
fn a_panicking_rank_ends_the_others_and_its_own_message_is_the_one_reported() {
    let said = std::panic::catch_unwind(|| {
        on_threads(3, |comm| {
            assert_ne!(comm.rank(), 1, "rank one has had enough");
            comm.barrier();
        });
    })
    .unwrap_err();
    let text = said.downcast_ref::<String>().expect("an assertion message");
    assert!(text.contains("had enough"), "{text}");
}

#[test]
fn every_rank_gets_the_words_of_the_lowest_one_that_has_failed_on_4_ranks() {
    on_threads(4, |comm| {
        let own = if comm.rank() % 2 == 1 { Err(format!("rank {} failed", comm.rank())) } else { Ok(()) };
        assert_eq!(comm.agree_words(own), Err("rank 1 failed".to_string()));
        assert_eq!(comm.agree_words(Ok(comm.rank())), Ok(comm.rank()));
    });
}

#[test]
fn results_come_back_by_rank() {
    assert_eq!(on_threads(4, |comm| comm.rank() * comm.size()), [0, 4, 8, 12]);
}
