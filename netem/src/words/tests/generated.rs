//! Any settings and almost any words, as proptest makes them.

use super::*;

fn any_time() -> impl Strategy<Value = Duration> {
    prop_oneof![
        (0..=3_600_000_000_000_u64).prop_map(Duration::from_nanos),
        (0..=3_600_000_u64).prop_map(Duration::from_millis),
    ]
}

fn any_share() -> impl Strategy<Value = Probability> {
    prop_oneof![Just(0), Just(1_000_000_000), 0..=1_000_000_000_u32]
        .prop_map(|parts| Probability::from_parts_per_billion(parts).unwrap())
}

fn any_chance() -> impl Strategy<Value = Chance> {
    (any_share(), any_share()).prop_map(|(probability, correlation)| Chance {
        probability,
        correlation,
    })
}

fn any_delay() -> impl Strategy<Value = Delay> {
    (0..8_usize, any_time(), any_time()).prop_map(|(kind, mean, jitter)| {
        if kind == 7 {
            let ns = |time: Duration| time.as_nanos() as u64;
            let points = [(ns(mean.min(jitter)), 0.0), (ns(mean.max(jitter)), 1.0)];
            return Delay {
                shape: Shape::Empirical(Arc::new(Cdf::try_new(None, &points).unwrap())),
                ..Delay::default()
            };
        }
        match SHAPES.get(kind) {
            None => Delay::constant(mean),
            Some((_, shape)) => Delay {
                mean,
                jitter,
                shape: shape.clone(),
            },
        }
    })
}

fn any_correlation(delay: &Delay) -> BoxedStrategy<Correlation> {
    let none = Just(Correlation::None);
    let in_time = (1..3_600_000_u64).prop_map(|ms| Correlation::InTime(MS * ms as u32));
    let per_packet = any_share().prop_map(Correlation::PerPacket);
    match delay.shape {
        Shape::Constant => none.boxed(),
        Shape::Empirical(_) => prop_oneof![none, in_time].boxed(),
        _ => prop_oneof![none, in_time, per_packet].boxed(),
    }
}

fn any_loss() -> impl Strategy<Value = Loss> {
    let independent = any_share().prop_map(|probability| Loss::Independent { probability });
    let correlated = (any_share(), 1..=1_000_000_000_u32).prop_map(|(probability, rho)| {
        let correlation = Probability::from_parts_per_billion(rho).unwrap();
        Loss::Correlated {
            probability,
            correlation,
        }
    });
    let four = [any_share(), any_share(), any_share(), any_share()];
    let gemodel = four.prop_map(|[to_bad, to_good, loss_in_bad, loss_in_good]| {
        Loss::Gemodel(GilbertElliott {
            to_bad,
            to_good,
            loss_in_bad,
            loss_in_good,
        })
    });
    let bursts = (any_share(), 1..3_600_000_u32, any_share(), any_share());
    let bursts = bursts.prop_map(|(share, ms, loss_inside, loss_between)| {
        Loss::Bursts(TimedBursts {
            share,
            mean: MS * ms,
            loss_inside,
            loss_between,
        })
    });
    let every = (1..=u64::MAX).prop_map(Loss::Every);
    let ranges = prop::collection::vec((0..1000_u64, 0..1000_u64), 1..5);
    let listed = ranges.prop_map(|ranges| {
        let ranges = ranges.into_iter().map(|(a, b)| (a.min(b), a.max(b)));
        Loss::Listed(Arc::new(PacketList::new(ranges.collect())))
    });
    prop_oneof![
        Just(Loss::None),
        independent,
        correlated,
        gemodel,
        bursts,
        every,
        listed
    ]
}

fn any_rate() -> impl Strategy<Value = (Option<Rate>, Queue)> {
    let framing = (-100..100_i32, 0..100_u32, 0..9_i32);
    let limits = (
        prop::option::of(1..1_u64 << 40),
        prop::option::of(1..=u32::MAX),
        prop::option::of(any_time()),
    );
    let codel = prop::option::of((1..1000_u32, 1..1000_u32));
    let rate = (1..=RATE_MAX_BIT_S, framing, limits, codel).prop_map(
        |(bits_per_second, (overhead, cell, cell_overhead), limits, codel)| {
            let rate = Rate {
                service: Service::Constant { bits_per_second },
                framing: Framing {
                    overhead,
                    cell,
                    cell_overhead,
                },
            };
            let queue = Queue {
                bytes: limits.0,
                packets: limits.1,
                wait: limits.2,
                drop_head: limits.0.is_some_and(|bytes| bytes % 2 == 0),
                codel: codel.map(|(target, interval)| Codel {
                    target: MS * target,
                    interval: MS * interval,
                }),
            };
            (Some(rate), queue)
        },
    );
    prop_oneof![Just((None, Queue::default())), rate]
}

fn any_slot() -> impl Strategy<Value = Slot> {
    let gap = prop_oneof![
        (any_time(), any_time()).prop_map(|(a, b)| SlotGap::Uniform {
            least: a.min(b),
            most: a.max(b),
        }),
        (any_time(), any_time()).prop_map(|(mean, jitter)| {
            let shape = Shape::Gamma;
            SlotGap::Drawn(Delay {
                mean,
                jitter,
                shape,
            })
        }),
    ];
    let (packets, bytes) = (1..=u32::MAX, 1..=u64::MAX);
    let most = (prop::option::of(packets), prop::option::of(bytes));
    (gap, most).prop_map(|(gap, (packets, bytes))| Slot {
        gap,
        packets,
        bytes,
    })
}

/// Settings without a profile.
fn any_settings() -> impl Strategy<Value = LinkConfig> {
    let order = prop_oneof![Just(Order::Fifo), Just(Order::Free)];
    let delay = any_delay().prop_flat_map(|delay| {
        let correlation = any_correlation(&delay);
        (Just(delay), correlation)
    });
    let reorder = prop::option::of((any_chance(), 1..1_000_000_u32));
    let outage = (any_time(), 1..1000_u32, prop::option::of(1000..2000_u32));
    let outages = prop::collection::vec(
        outage.prop_map(|(at, length, every)| Outage {
            at,
            length: MS * length,
            every: every.map(|every| MS * every),
        }),
        0..3,
    );
    let mtu = prop::option::of(1..=u32::MAX);
    let first = (delay, order, reorder, any_loss(), outages);
    let bytes = prop_oneof![Just(Limit::default().bytes), 1..=LIMIT_MAX_BYTES];
    let limit = (1..=LIMIT_MAX, bytes).prop_map(|(packets, bytes)| Limit { packets, bytes });
    let second = (any_chance(), any_chance(), mtu, any_rate(), limit);
    let cross = (1..=8_000_000_u64, 1..=65_535_u32);
    let cross = cross.prop_map(|(bits_per_second, bytes)| Cross {
        bits_per_second,
        bytes,
    });
    let third = (
        prop::option::of(any_slot()),
        any::<bool>(),
        prop::option::of(cross),
    );
    (first, second, third).prop_map(|(first, second, (slot, ecn, cross))| {
        let ((delay, correlation), order, reorder, loss, outages) = first;
        let (duplicate, corrupt, mtu, (rate, queue), limit) = second;
        let movable = delay != Delay::default();
        LinkConfig {
            reorder: reorder
                .filter(|_| movable)
                .map(|(chance, gap)| Reorder { chance, gap }),
            correlation: if movable {
                correlation
            } else {
                Correlation::None
            },
            delay,
            order,
            slot,
            ecn: ecn && (loss != Loss::None || queue.codel.is_some()),
            loss,
            outages,
            duplicate,
            corrupt,
            mtu,
            cross: cross.filter(|_| rate.is_some()),
            rate,
            queue,
            limit,
            ..LinkConfig::default()
        }
    })
}

fn any_config() -> impl Strategy<Value = LinkConfig> {
    prop::collection::vec(any_link(), 1..4).prop_map(|links| {
        let links = links.into_iter().rev();
        let chain = links.fold(None, |then, link| {
            Some(Box::new(LinkConfig { then, ..link }))
        });
        *chain.unwrap()
    })
}

fn any_link() -> impl Strategy<Value = LinkConfig> {
    let step = (1..1000_u32, 0..1000_u32, any_settings());
    let steps = prop::collection::vec(step, 0..3);
    let seed = prop::option::of(any::<u64>());
    (any_settings(), steps, any::<bool>(), seed).prop_map(|(config, steps, repeats, seed)| {
        let mut profile = Profile::default();
        let mut free_from = Duration::ZERO;
        for (after, ramp, settings) in steps {
            let (at, ramp) = (free_from + MS * after, MS * ramp);
            free_from = at + ramp;
            profile.steps.push(Step { at, ramp, settings });
        }
        profile.repeat = (repeats && !profile.steps.is_empty()).then(|| free_from + MS);
        LinkConfig {
            profile,
            seed,
            ..config
        }
    })
}

/// Texts made of the language's own words and numbers, so that the parser gets far into them.
fn nearly_words() -> impl Strategy<Value = String> {
    let word = prop_oneof![
        prop::sample::select(vec![
            "delay",
            "loss",
            "random",
            "order",
            "fifo",
            "free",
            "limit",
            "none",
            "distribution",
            "normal",
            "uniform",
            "gemodel",
            "state",
            "burst",
            "every",
            "list",
            "tau",
            "cdf",
            "rate",
            "queue",
            "codel",
            "reorder",
            "gap",
            "duplicate",
            "outage",
            "for",
            "preset",
            "trace",
            "slot",
            "packets",
            "bytes",
            "ecn",
            "seed",
            "; at",
            "over",
            "; loop",
            "; then",
            "cross",
            "poisson",
            "%",
            "ms",
            "é",
            "\u{0}",
        ])
        .prop_map(str::to_owned),
        "[0-9.]{0,25}(h|min|s|ms|us|ns|%|)",
        "\\PC{0,4}",
    ];
    prop::collection::vec(word, 0..8).prop_map(|words| words.join(" "))
}

proptest! {
    #[test]
    fn printing_and_parsing_are_inverses(config in any_config()) {
        let text = config.to_string();
        prop_assert_eq!(text.parse::<LinkConfig>(), Ok(config));
    }

    #[test]
    fn whatever_parses_is_in_range_and_whatever_does_not_is_pointed_at(
        text in prop_oneof![nearly_words(), any::<String>()],
    ) {
        match text.parse::<LinkConfig>() {
            Ok(config) => {
                prop_assert_eq!(config.check(), Ok::<(), ConfigError>(()));
                prop_assert_eq!(config.to_string().parse(), Ok(config));
            }
            Err(error) => {
                let at: String = text
                    .chars()
                    .skip(error.column - 1)
                    .take(error.word.chars().count())
                    .collect();
                prop_assert_eq!(at, error.word.clone());
                prop_assert!(!error.to_string().is_empty());
                prop_assert!(error.pointer(&text).ends_with('^'));
            }
        }
    }
}
