//! Runs the filter of the crate fusion-nav on a scenario of `examples/navigation_scenarios.py`.
//!
//! Lines of words and numbers come on standard input; a line `out` prints the state with its
//! covariance. `benches/navigation_peer.py` writes the lines and reads the numbers.

use std::io::{self, BufRead, BufWriter, Write};

use fusion_nav::{Quaternion, STATES, prelude::*};

fn main() {
    let mut config = Config::default();
    let mut filter = None;
    let mut out = BufWriter::new(io::stdout().lock());
    for line in io::stdin().lock().lines().map_while(Result::ok) {
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        let x: Vec<f64> = words.map(|text| text.parse().expect("a number")).collect();
        match word {
            "config" => configure(&mut config, &x),
            "seed" => filter = Some(seed(config, &x)),
            _ => take(filter.as_mut().expect("a seed comes first"), word, &x, &mut out),
        }
    }
}

/// Noise of gyro and accelerometer, walks of their biases and of the barometer, gravity; limits of
/// tilt, heading, position and velocity.
fn configure(config: &mut Config, x: &[f64]) {
    let v: Vec<f32> = x.iter().map(|&value| value as f32).collect();
    config.imu.gyro_white = v[0];
    config.imu.accel_white = v[1];
    config.imu.gyro_bias_walk = v[2];
    config.imu.accel_bias_walk = v[3];
    config.baro_offset_walk = v[4];
    config.gravity = v[5];
    config.accuracy.tilt = Radians::from_radians(v[6]);
    config.accuracy.heading = Radians::from_radians(v[7]);
    config.accuracy.position = Meters::from_meters(v[8]);
    config.accuracy.velocity = MetersPerSecond::from_m_per_s(v[9]);
}

/// Time; latitude, longitude, height; velocity; quaternion; gyro bias; 15 standard deviations.
fn seed(config: Config, x: &[f64]) -> Eskf {
    let mut filter = Eskf::new(config).expect("a valid configuration");
    let f = |i: usize| x[i] as f32;
    let attitude = Quaternion { w: f(7), x: f(8), y: f(9), z: f(10) };
    let state = State {
        attitude: Attitude::from_body_to_ned(attitude),
        velocity: Velocity::ned(f(4), f(5), f(6)),
        gyro_bias: AngularRate::body(f(11), f(12), f(13)),
        ..State::default()
    };
    let sigmas: [f32; STATES] = std::array::from_fn(|i| f(14 + i));
    assert!(filter.set_magnetic_declination(Radians::from_radians(0.0)));
    let _ = filter
        .initialize_from(state, Covariance::from_sigmas(sigmas), Timestamp::from_secs_f64(x[0]))
        .expect("a valid seed");
    let _ = filter.set_origin(Geodetic::from_degrees(x[1], x[2], x[3]));
    filter
}

fn take(filter: &mut Eskf, word: &str, x: &[f64], out: &mut impl Write) {
    let time = Timestamp::from_secs_f64(x[0]);
    let f = |i: usize| x[i] as f32;
    match word {
        "imu" => {
            let (gyro, accel) =
                (AngularRate::body(f(2), f(3), f(4)), Acceleration::body(f(5), f(6), f(7)));
            let interval = Seconds::from_secs(f(1));
            let _ = filter.predict(ImuSample::from_rates(time, gyro, accel, interval));
        }
        "fix" => {
            let zero = Position::zero();
            let place = Geodetic::from_degrees(x[1], x[2], x[3]);
            let noise = PositionNoise::from_sigma(f(7), f(8), f(9));
            let _ = filter.fuse_gnss_geodetic(time, place, noise, zero);
            let noise = VelocityNoise::from_sigma(f(10), f(11), f(12));
            let _ = filter.fuse_gnss_velocity(time, Velocity::ned(f(4), f(5), f(6)), noise, zero);
        }
        "height" => {
            let noise = AltitudeNoise::from_sigma(f(2));
            let _ = filter.fuse_baro_altitude(time, Altitude::from_meters(f(1)), noise);
        }
        "field" => {
            let field = MagField::body(f(1), f(2), f(3));
            let _ = filter.fuse_mag_heading(time, field, HeadingNoise::from_sigma(f(4)));
        }
        "heading" => {
            let (heading, noise) = (Radians::from_radians(f(1)), HeadingNoise::from_sigma(f(2)));
            let _ = filter.fuse_gnss_heading(time, heading, noise);
        }
        "out" => print(filter, x[0], out).expect("standard output is open"),
        _ => panic!("no such line: {word}"),
    }
}

/// Time, position, velocity, quaternion, biases of accelerometer and gyro, six verdicts, covariance.
fn print(filter: &Eskf, time: f64, out: &mut impl Write) -> io::Result<()> {
    let (state, place) = (filter.state(), filter.geodetic_position());
    let place = place.map_or([f64::NAN; 3], |p| [p.latitude_deg(), p.longitude_deg(), p.height()]);
    let q = state.attitude.body_to_ned();
    let v = state.validity;
    write!(out, "{time} {} {} {}", place[0], place[1], place[2])?;
    let biases = [state.accel_bias.to_array(), state.gyro_bias.to_array()].concat();
    let numbers = [state.velocity.to_array().to_vec(), vec![q.w, q.x, q.y, q.z], biases];
    for value in numbers.iter().flatten().chain(filter.covariance().to_rows().iter().flatten()) {
        write!(out, " {value}")?;
    }
    let horizontal = v.horizontal_velocity && v.vertical_velocity;
    for valid in [v.horizontal_position, v.vertical_position, horizontal, v.tilt, v.heading] {
        write!(out, " {}", u8::from(valid))?;
    }
    writeln!(out)
}
