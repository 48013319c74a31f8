//! Maps the clock of a browser's page to the loop's by the least delay that a reading has needed.
//!
//! A reading carries the page's stamp and arrives a delay later. The delay is never negative and sometimes small, so
//! that the least difference of arrival and stamp is the offset of the two clocks plus the least delay. Waits of the
//! page's thread, of the network or of a busy host only make single differences larger, and change nothing.

/// How fast the offset may grow, s per s: two quartz clocks at 100 ppm each. Without it a page whose clock is slower
/// would seem to be ever later.
const DRIFT: f64 = 2e-4;

/// The minimum-offset filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ClockMap {
    /// Arrival and least difference of arrival and stamp then, s; none before the first reading.
    least: Option<(f64, f64)>,
}

impl ClockMap {
    /// Takes a reading of stamp `page_s` (s, the page's clock) that arrived at `now_s` (s, the loop's).
    pub(super) fn push(&mut self, now_s: f64, page_s: f64) {
        let found = now_s - page_s;
        let offset = self.offset(now_s).map_or(found, |known| known.min(found));
        self.least = Some((now_s, offset));
    }

    /// The page's time at `now_s`, s; none before the first reading.
    pub(super) fn page_s(&self, now_s: f64) -> Option<f64> {
        self.offset(now_s).map(|offset| now_s - offset)
    }

    fn offset(&self, now_s: f64) -> Option<f64> {
        self.least
            .map(|(at, offset)| offset + DRIFT * (now_s - at).max(0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mmt_shared::rng::Substream;

    #[test]
    fn the_offset_is_that_of_the_fastest_reading_whatever_the_others_waited() {
        let mut stream = Substream::new(1, "clock-map", 0);
        let mut map = ClockMap::default();
        let mut mean = 0.0;
        for n in 0..1000 {
            let page = 5000.0 + f64::from(n) * 0.008;
            let wait = if n % 50 == 7 {
                0.001
            } else {
                stream.uniform_in(0.002, 0.060)
            };
            mean += wait / 1000.0;
            map.push(page - 4990.0 + wait, page);
        }
        assert!(mean > 0.02, "the effect is there: {mean}");
        let (now, page) = (18.0, 5008.0);
        let error = map.page_s(now).unwrap() - (page - 0.001);
        assert!(error.abs() < 3e-4, "{error}");
    }

    #[test]
    fn a_page_whose_clock_is_slower_is_followed() {
        let mut map = ClockMap::default();
        for n in 0..60_000 {
            let now = f64::from(n) * 0.01;
            map.push(now, now * (1.0 - 1e-4));
        }
        let now = 600.0;
        let error = map.page_s(now).unwrap() - now * (1.0 - 1e-4);
        assert!(error.abs() < 1e-5, "{error}");
    }

    #[test]
    fn nothing_is_known_before_the_first_reading() {
        assert_eq!(ClockMap::default().page_s(1.0), None);
    }
}
