"""Text logs in the forms that people have them in, all of one true motion.

A row of a form is a template; `fields` are what may stand in it.
"""

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

N = 1200
RATE = 100.0
EPOCH = 1_714_560_000
G = 9.80665


def motion(t):
    """Turns (rad/s) and accelerations (m/s²) that differ on every axis, shape (n, 3) each."""
    phase = np.array([[3.0, 2.1, 0.7]])
    w = np.sin(np.outer(t, [2.3, 3.1, 1.7]) + phase) * [0.4, 0.3, 0.25] + [-0.31, -0.33, 0.09]
    a = np.sin(np.outer(t, [1.9, 1.1, 2.7]) + phase) * [1.1, 0.7, 0.4] + [0.2, 0.3, 9.85]
    return w, a


def motion_of(rate):
    t = np.arange(N) / rate
    return t, *motion(t)


@dataclass(frozen=True)
class Form:
    """A file of a form and what is to be read of it.

    ``expected`` is ``"read"``, ``"asks"`` where the unit cannot be known, else words of the
    refusal. ``gyro``, ``accel`` and ``mag`` are the units in which values stand in the file,
    None for what is not there; ``axes`` the letters of the gyro; ``to`` the rounding of the cells.
    """

    name: str
    text: str
    expected: str = "read"
    gyro: str | None = "rad/s"
    accel: str | None = None
    mag: str | None = None
    rate: float = RATE
    axes: str = "xyz"
    file: str = "log.csv"
    to: float = 1e-6
    encoding: str = "utf-8"
    listed: bool = True
    rows: int = N
    options: tuple = ()

    def write(self, folder):
        path = folder / self.file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(self.text.encode(self.encoding))
        return path

    def truth(self, kind):
        """Return the true values of a kind in the unit of the file, shape (n, 3)."""
        _, w, a = motion_of(self.rate)
        if kind == "mag":
            return np.tile([20.0, 21.0, 22.0], (self.rows, 1))
        values, unit = (w, self.gyro) if kind == "gyro" else (a, self.accel)
        places = ["xyz".index(axis) for axis in self.axes] if kind == "gyro" else [0, 1, 2]
        return (values * PER[unit])[: self.rows, places]


PER = {
    "rad/s": 1.0,
    "deg/s": 180 / np.pi,
    "mdps": 180e3 / np.pi,
    "mrad/s": 1e3,
    "rpm": 30 / np.pi,
    "deg/min": 60 * 180 / np.pi,
    "m/s^2": 1.0,
    "g": 1 / G,
    "mg": 1e3 / G,
}


def fields(rate=RATE):
    """Yield what may stand in a row, one dict a sample."""
    t, w, a = motion_of(rate)
    for i in range(N):
        us = round(t[i] * 1e6)
        when = datetime.fromtimestamp(EPOCH, UTC) + timedelta(microseconds=us)
        one = {"i": i, "s": t[i], "ms": us // 1000, "us": us, "ns": us * 1000}
        one |= {
            "es": EPOCH + t[i],
            "ems": EPOCH * 1000 + us // 1000,
            "ens": (EPOCH * 10**6 + us) * 1000,
        }
        one |= {
            "sec": EPOCH + us // 10**6,
            "nsec": us % 10**6 * 1000,
            "days": 45413.5 + t[i] / 86400,
        }
        one |= {
            "iso": f"{when:%Y-%m-%dT%H:%M:%S.%f}",
            "when": when,
            "clock": f"{when:%H:%M:%S.%f}"[:-3],
            "part": us // 1000 % 1000,
        }
        for letter, value, acceleration, field in zip(
            "xyz", w[i], a[i], (20.0, 21.0, 22.0), strict=True
        ):
            one |= {f"w{letter}": value, f"d{letter}": np.degrees(value), f"m{letter}": field}
            one |= {f"a{letter}": acceleration, f"g{letter}": acceleration / G}
        one |= {"w3": "{wx:.6f},{wy:.6f},{wz:.6f}".format(**one)}
        one |= {"d3": "{dx:.6f},{dy:.6f},{dz:.6f}".format(**one)}
        one |= {"a3": "{ax:.6f},{ay:.6f},{az:.6f}".format(**one)}
        one |= {"g3": "{gx:.6f},{gy:.6f},{gz:.6f}".format(**one)}
        one |= {"m3": "20.0,21.0,22.0"}
        yield one


_FIELDS = {rate: list(fields(rate)) for rate in (RATE, 5.0, 1.0)}


def form(name, head, row, *args, rate=RATE, tabs=False, decimal=".", **more):
    """Return a form of a header (with its line's end) and a template of a row."""
    body = "".join(row.format(**one) + "\n" for one in _FIELDS[rate])
    body = body.replace(".", decimal) if decimal != "." else body
    text = (head + body).replace(",", "\t") if tabs else head + body
    return Form(name, text, *args, rate=rate, **more)


DEG, RAD = {"gyro": "deg/s"}, {"gyro": "rad/s"}
MS2, IN_G = {"accel": "m/s^2"}, {"accel": "g"}
XSENS = (
    "// General information:\n//  MT Manager version: 2019.2\n//  DeviceId: 00B42D4B\n"
    "// Device settings:\n//  Update Rate: 100.0Hz\n//  Filter Profile: human(46.1)\n"
)
DOT = (
    "sep=,\nDeviceTag:,Xsens DOT 1\nFirmwareVersion:,2.4.0\nAppVersion:,2021.0\n"
    "SyncStatus:,Unsynced\nOutputRate:,100Hz\nFilterProfile:,General\n"
    "Measurement Mode:,Custom Mode 1\nStartTime:,2021-01-01_12-00-00_000\n"
    "© Xsens Technologies B. V. 2005-2021\n\n"
)
ACTIGRAPH = (
    "------------ Data File Created By ActiGraph Link ActiLife v6.13.3 Firmware v1.7.1 date format "
    "M/d/yyyy at 100 Hz  Filter Normal -----------\nSerial Number: TAS1D48140206\n"
    "Start Time 12:00:00\nStart Date 5/1/2024\nEpoch Period (hh:mm:ss) 00:00:00\n"
    "Download Time 16:48:55\nDownload Date 5/1/2024\nCurrent Memory Address: 0\n"
    "Current Battery Voltage: 4.12     Mode = 12\n"
    "--------------------------------------------------\n"
)
SENSORLOG = (
    "loggingTime(txt),loggingSample(N),locationTimestamp_since1970(s),locationLatitude(WGS84),"
    "accelerometerTimestamp_sinceReboot(s),accelerometerAccelerationX(G),"
    "accelerometerAccelerationY(G),accelerometerAccelerationZ(G),gyroTimestamp_sinceReboot(s),"
    "gyroRotationX(rad/s),gyroRotationY(rad/s),gyroRotationZ(rad/s),motionTimestamp_sinceReboot(s),"
    "motionYaw(rad),motionRoll(rad),motionPitch(rad),motionRotationRateX(rad/s),"
    "motionRotationRateY(rad/s),motionRotationRateZ(rad/s),motionUserAccelerationX(G),"
    "motionUserAccelerationY(G),motionUserAccelerationZ(G),motionGravityX(G),motionGravityY(G),"
    "motionGravityZ(G)\n"
)
WITMOTION = (
    "Time,Device name,Chip Time(),Acceleration X(g),Acceleration Y(g),Acceleration Z(g),"
    "Angular velocity X(°/s),Angular velocity Y(°/s),Angular velocity Z(°/s),Shift speed X(mm/s),"
    "Shift speed Y(mm/s),Shift speed Z(mm/s),Angle X(°),Angle Y(°),Angle Z(°),Magnetic field X(ʯt),"
    "Magnetic field Y(ʯt),Magnetic field Z(ʯt),Temperature(°C)\n"
)
SHIMMER = "\t".join(
    f"Shimmer_5E60_{name}_CAL"
    for name in (
        "Timestamp_Unix",
        *(f"Accel_LN_{axis}" for axis in "XYZ"),
        *(f"Gyro_{axis}" for axis in "XYZ"),
        *(f"Mag_{axis}" for axis in "XYZ"),
    )
)
SHIMMER_UNITS = "\t".join(["ms", *["m/(s^2)"] * 3, *["deg/s"] * 3, *["local_flux"] * 3])
ULOG = (
    "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,"
    "accelerometer_timestamp_relative,accelerometer_m_s2[0],accelerometer_m_s2[1],"
    "accelerometer_m_s2[2],accelerometer_integral_dt,accelerometer_clipping,gyro_clipping,"
    "accel_calibration_count,gyro_calibration_count\n"
)
EUROC = (
    "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],"
    "a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]\n"
)


def phones():
    """Yield the forms of phones and watches."""
    yield form(
        "sensor logger combined",
        "time,seconds_elapsed,accelerometer_z,accelerometer_y,accelerometer_x,gravity_z,gravity_y,"
        "gravity_x,gyroscope_z,gyroscope_y,gyroscope_x,magnetometer_z,magnetometer_y,"
        "magnetometer_x,orientation_qz,orientation_qy,orientation_qx,orientation_qw,"
        "orientation_roll,orientation_pitch,orientation_yaw\n",
        "{ens},{s:.6f},{az:.6f},{ay:.6f},{ax:.6f},{az:.6f},{ay:.6f},{ax:.6f},{wz:.6f},{wy:.6f},"
        "{wx:.6f},22.0,21.0,20.0,0,0,0,1,0,0,0",
        "asks", accel="m/s^2", mag="uT",
    )  # fmt: skip
    for name, column in (("uncal", "gyroscopeuncalibrated"), ("cal", "gyroscope")):
        yield form(
            f"sensor logger {name}",
            f"time,seconds_elapsed,{column}_z,{column}_y,{column}_x\n",
            "{ens},{s:.6f},{wz:.6f},{wy:.6f},{wx:.6f}",
            "asks",
            listed=name == "uncal",
        )
    zyx = "time,seconds_elapsed,z,y,x\n", "{ens},{s:.6f},{wz:.6f},{wy:.6f},{wx:.6f}"
    yield form("sensor logger gyroscope", *zyx, "asks", file="Gyroscope.csv")
    yield form("sensor logger unnamed", *zyx, "columns=", file="log.csv", listed=False)
    yield form(
        "phyphox gyro csv",
        '"Time (s)","Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)",'
        '"Absolute (rad/s)"\n',
        "{s:.9E},{wx:.9E},{wy:.9E},{wz:.9E},{wx:.9E}",
    )
    yield form(
        "phyphox semicolon comma",
        '"Time (s)";"Gyroscope x (rad/s)";"Gyroscope y (rad/s)";"Gyroscope z (rad/s)"\n',
        "{s:.9E};{wx:.9E};{wy:.9E};{wz:.9E}",
        decimal=",",
    )
    for name, column in (("accel", "Acceleration"), ("linear accel", "Linear Acceleration")):
        yield form(
            f"phyphox {name}",
            f'"Time (s)","{column} x (m/s^2)","{column} y (m/s^2)","{column} z (m/s^2)",'
            '"Absolute acceleration (m/s^2)"\n',
            "{s:.9E},{ax:.9E},{ay:.9E},{az:.9E},9.8E+00",
            "no column looks like a gyro",
            gyro=None,
            accel="m/s^2" if name == "accel" else None,
        )
    yield form(
        "physics toolbox de",
        "time;wx;wy;wz\n",
        "{s:.6f};{wx:.6f};{wy:.6f};{wz:.6f}",
        "asks",
        decimal=",",
    )
    yield form(
        "sensorlog ios",
        SENSORLOG,
        "{when:%Y-%m-%d %H:%M:%S.%f} +0200,{i},1714560000.0,48.0,{s:.6f},{g3},{s:.6f},{w3},{s:.6f},"
        "0.1,0.2,0.3,{wx:.3f},{wy:.3f},{wz:.3f},0.1,0.2,0.3,{g3}",
        accel="g",
    )
    yield form(
        "rotationrate xyz",
        "time_s,rotationRate.x,rotationRate.y,rotationRate.z\n",
        "{s:.6f},{d3}",
        "asks",
        **DEG,
    )
    yield form(
        "apple watch",
        "timestamp,motionRotationRateX,motionRotationRateY,motionRotationRateZ\n",
        "{es:.3f},{d3}",
        "asks",
        **DEG,
    )
    yield form(
        "android long rows",
        "timestamp,sensor,x,y,z\n",
        "{ems},acc,{a3}\n{ems},gyr,{w3}",
        "asks",
        accel="m/s^2",
    )
    yield form(
        "gsdc device imu",
        "MessageType,utcTimeMillis,elapsedRealtimeNanos,MeasurementX,MeasurementY,MeasurementZ,"
        "BiasX,BiasY,BiasZ\n",
        "UncalAccel,{ems},{ens},{a3},0,0,0\nUncalGyro,{ems},{ens},{w3},0,0,0\n"
        "UncalMag,{ems},{ens},{m3},0,0,0",
        "asks",
        accel="m/s^2",
        mag="uT",
    )
    yield form(
        "matlab mobile csv",
        "Timestamp,X,Y,Z\n",
        "{when:%d-%b-%Y %H:%M:%S.%f},{w3}",
        "asks",
        file="AngularVelocity.csv",
    )
    yield form(
        "matlab named",
        "Timestamp,AngularVelocity_X,AngularVelocity_Y,AngularVelocity_Z\n",
        "{when:%d-%b-%Y %H:%M:%S.%f},{w3}",
        "asks",
    )


def trackers():
    """Yield the forms of sensors that are worn, and of laboratories."""
    yield form(
        "metawear",
        "epoch (ms),time (+02:00),elapsed (s),x-axis (deg/s),y-axis (deg/s),z-axis (deg/s)\n",
        "{ems},{iso},{s:.3f},{dx:.3f},{dy:.3f},{dz:.3f}",
        to=1e-3,
        **DEG,
    )
    yield form(
        "witmotion new",
        WITMOTION,
        "{clock},WT901(AA:BB),{when:%Y-%m-%d} {clock},{gx:.3f},{gy:.3f},{gz:.3f},{dx:.3f},{dy:.3f},"
        "{dz:.3f},0,0,0,0,0,0,{m3},25.0",
        to=1e-3,
        **DEG,
        **IN_G,
    )
    yield form(
        "witmotion txt",
        "Time(s),ax(g),ay(g),az(g),wx(deg/s),wy(deg/s),wz(deg/s),AngleX(deg),AngleY(deg),"
        "AngleZ(deg),T(°)\n",
        "{s:.3f},{g3},{d3},0,0,0,25.0",
        tabs=True,
        file="log.txt",
        **DEG,
        **IN_G,
    )
    yield form(
        "xsens mtmanager",
        XSENS + "PacketCounter,SampleTimeFine,Year,Month,Day,Second,UTC_Valid,Acc_X,Acc_Y,Acc_Z,"
        "FreeAcc_X,FreeAcc_Y,FreeAcc_Z,Gyr_X,Gyr_Y,Gyr_Z,Mag_X,Mag_Y,Mag_Z,VelInc_X,VelInc_Y,"
        "VelInc_Z,OriInc_q0,OriInc_q1,OriInc_q2,OriInc_q3,Roll,Pitch,Yaw\n",
        "{i},{i}00,,,,,,{a3},{gx:.6f},{gy:.6f},{gz:.6f},{w3},{m3},0.1,0.2,0.3,1,0,0,0,0,0,0",
        "asks",
        tabs=True,
        file="MT_00B42D4B-000.txt",
        accel="m/s^2",
    )
    dot = "PacketCounter,SampleTimeFine,Euler_X,Euler_Y,Euler_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,"
    yield form(
        "movella dot",
        DOT + dot + "Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z,Mag_X,Mag_Y,Mag_Z,\n",
        "{i},{us},0,0,0,{gx:.6f},{gy:.6f},{gz:.6f},{a3},{d3},{m3},",
        "asks",
        **DEG,
        **MS2,
    )
    yield form(
        "movella dot plain",
        "PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,FreeAcc_X,FreeAcc_Y,FreeAcc_Z,"
        "Gyr_X,Gyr_Y,Gyr_Z,Status,ClipCountAcc,ClipCountGyr\n",
        "{i},{us},1,0,0,0,{g3},{d3},0,0,0",
        "asks",
        **DEG,
    )
    yield form(
        "shimmer consensys",
        f'"sep=\t"\n{SHIMMER}\n{SHIMMER_UNITS}\t\n',
        "{ems},{a3},{d3},{m3},",
        tabs=True,
        **DEG,
        **MS2,
    )
    yield form(
        "shimmer raw and cal",
        "Timestamp_CAL,Gyro_X_RAW,Gyro_Y_RAW,Gyro_Z_RAW,Gyro_X_CAL,Gyro_Y_CAL,Gyro_Z_CAL\n",
        "{ems}.000,{i},{i},-{i},{d3}",
        "asks",
        tabs=True,
        **DEG,
    )
    yield form(
        "actigraph",
        ACTIGRAPH + "Timestamp,Accelerometer X,Accelerometer Y,Accelerometer Z,Temperature,"
        "Gyroscope X,Gyroscope Y,Gyroscope Z,Magnetometer X,Magnetometer Y,Magnetometer Z\n",
        "{iso}0,{g3},25.0,{d3},{m3}",
        "asks",
        mag="uT",
        **DEG,
        **IN_G,
    )
    yield form("axivity", "", "{when:%Y-%m-%d %H:%M:%S.%f},{g3},{d3}", "columns=", **DEG)
    yield form(
        "vectornav",
        "TimeStartup,Yaw,Pitch,Roll,GyroX,GyroY,GyroZ,AccelX,AccelY,AccelZ,UncompGyroX,UncompGyroY,"
        "UncompGyroZ,Temperature\n",
        "{ns},0,0,0,{d3},{a3},{dx:.3f},{dy:.3f},{dz:.3f},25.0",
        "asks",
        **DEG,
        **MS2,
    )
    yield form(
        "delsys",
        "X[s],EMG1.EMG,X[s].1,ACC.X 1[g],X[s].2,ACC.Y 1[g],X[s].3,GYRO.X 1[°/s],X[s].4,"
        "GYRO.Y 1[°/s],X[s].5,GYRO.Z 1[°/s]\n",
        "{s:.6f},0,{s:.6f},{gx:.6f},{s:.6f},{gy:.6f},{s:.6f},{dx:.6f},{s:.6f},{dy:.6f},{s:.6f},"
        "{dz:.6f}",
        **DEG,
    )
    yield form(
        "ximu3",
        "Timestamp (us),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),"
        "Accelerometer X (g),Accelerometer Y (g),Accelerometer Z (g)\n",
        "{us},{d3},{g3}",
        **DEG,
        **IN_G,
    )


def autopilots():
    """Yield the forms of drones and robots."""
    head = "loopIteration,time,gyroADC[0],gyroADC[1],gyroADC[2]"
    yield form(
        "betaflight", head + "\n", "{i},5{us:08d},{dx:.0f},{dy:.0f},{dz:.0f}", "asks", to=1, **DEG
    )
    yield form(
        "betaflight unfilt",
        head + ",gyroUnfilt[0],gyroUnfilt[1],gyroUnfilt[2]\n",
        "{i},5{us:08d},1,2,3,{dx:.0f},{dy:.0f},{dz:.0f}",
        "asks",
        to=1,
        **DEG,
    )
    imu = "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz\n"
    tail = "0,0,45.0,1,1,100,100"
    for several in (False, True):
        row = "{es:.8f},1{us:08d},0,{w3},{a3}," + tail
        other = "\n{es:.8f},1{us:08d}.5,1,9,9,9,{a3}," + tail if several else ""
        name = "ardupilot mavlogdump" if several else "ardupilot one imu"
        yield form(name, imu, row + other, "asks", accel="m/s^2")
    yield form(
        "ardupilot missionplanner log",
        "",
        "IMU, {us}, 0, {wx:.6f}, {wy:.6f}, {wz:.6f}, {ax:.6f}, {ay:.6f}, {az:.6f}, 0, 0, 45, 1, 1, "
        "100, 100\nATT, {us}, 0, 1, 0, 1, 0, 1, 0, 0, 3",
        "asks",
        accel="m/s^2",
        file="2024-05-01.log",
    )
    yield form(
        "ulog2csv sensor combined",
        ULOG,
        "1{us:08d},{w3},4000,0,{a3},4000,0,0,0,0",
        accel="m/s^2",
    )
    yield form(
        "ulog2csv vehicle imu",
        "timestamp,timestamp_sample,accel_device_id,gyro_device_id,delta_angle[0],delta_angle[1],"
        "delta_angle[2],delta_velocity[0],delta_velocity[1],delta_velocity[2],delta_angle_dt,"
        "delta_velocity_dt\n",
        "1{us:08d},1{us:08d},2883594,2883594,{w3},{a3},10000,10000",
        "no column looks like a gyro",
    )
    yield form(
        "ulog2csv sensor gyro",
        "timestamp,timestamp_sample,device_id,x,y,z,temperature,error_count,clip_counter[0],"
        "clip_counter[1],clip_counter[2],samples\n",
        "1{us:08d},1{us:08d},2883594,{w3},45.0,0,0,0,0,0",
        "asks",
        file="flight_sensor_gyro_0.csv",
    )
    yield form(
        "bagpy",
        "Time,header.seq,header.stamp.secs,header.stamp.nsecs,header.frame_id,"
        "angular_velocity.x,angular_velocity.y,angular_velocity.z,linear_acceleration.x,"
        "linear_acceleration.y,linear_acceleration.z\n",
        "{es:.6f},{i},{sec},{nsec},imu,{w3},{a3}",
        "asks",
        accel="m/s^2",
    )
    yield form("euroc", EUROC, "{ens},{w3},{a3}", file="imu0/data.csv", accel="m/s^2")
    for name, first, second in (
        ("seconds nanoseconds columns", "seconds", "nanoseconds"),
        ("stamp sec nanosec", "header.stamp.sec", "header.stamp.nanosec"),
        ("time sec time nsec", "time_sec", "time_nsec"),
    ):
        yield form(name, f"{first},{second},gyro_x,gyro_y,gyro_z\n", "{sec},{nsec},{w3}", "asks")
    yield form(
        "mavlink raw mrads",
        "time_boot_ms,xacc_mg,yacc_mg,zacc_mg,xgyro_mradps,ygyro_mradps,zgyro_mradps\n",
        "{ms},1,2,1000,{wx:.3f}0,{wy:.3f}0,{wz:.3f}0",
        "asks",
        to=1e-3,
    )


def spellings():
    """Yield the forms that differ in names and units."""
    yield form(
        "gyro norm", "time_s,gyro_x,gyro_y,gyro_z,gyro_norm\n", "{s:.6f},{d3},20.0", "asks", **DEG
    )
    yield form("gx in g", "time_s,gx (g),gy (g),gz (g)\n", "{s:.6f},{g3}", "is in g", gyro=None)
    yield form(
        "zyx order",
        "time_s,gyro_z_dps,gyro_y_dps,gyro_x_dps,accel_z_g,accel_y_g,accel_x_g\n",
        "{s:.6f},{dz:.6f},{dy:.6f},{dx:.6f},{gz:.6f},{gy:.6f},{gx:.6f}",
        **DEG,
        **IN_G,
    )
    yield form(
        "yaw pitch roll rate",
        "time_s,yaw_rate,pitch_rate,roll_rate\n",
        "{s:.6f},{dz:.6f},{dy:.6f},{dx:.6f}",
        "asks",
        **DEG,
    )
    yield form("gx brackets", "t[s],gx[deg/s],gy[deg/s],gz[deg/s]\n", "{s:.6f},{d3}", **DEG)
    yield form("GyrX units", "Time(s),GyrX(dps),GyrY(dps),GyrZ(dps)\n", "{s:.6f},{d3}", **DEG)
    yield form(
        "rad values named dps header unit",
        "time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps\n",
        "{s:.6f},{d3}",
        **DEG,
    )
    for name, suffix, unit in (
        ("st mdps", "mdps", "mdps"),
        ("mrads", "mrad/s", "mrad/s"),
        ("rpm", "rpm", "rpm"),
        ("degpmin", "deg/min", "deg/min"),
    ):
        heads = ",".join(f"gyro_{axis} [{suffix}]" for axis in "xyz")
        factor = PER[unit]
        text = f"time_s,{heads}\n" + "".join(
            f"{one['s']:.6f}," + ",".join(f"{one[f'w{x}'] * factor:.9f}" for x in "xyz") + "\n"
            for one in _FIELDS[RATE]
        )
        yield Form(name, text, "asks", gyro=unit)
    yield form(
        "gyro timestamp",
        "gyro_timestamp,gyro_x,gyro_y,gyro_z\n",
        "{s:.6f},{d3}",
        "asks",
        **DEG,
    )
    yield form(
        "accuracy column",
        "time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps,gyro_accuracy\n",
        "{s:.6f},{d3},3",
        **DEG,
    )
    yield form(
        "gps accuracy",
        "time_s,gyro_x_dps,gyro_y_dps,gyro_z_dps,gps_accuracy\n",
        "{s:.6f},{d3},3",
        **DEG,
    )
    yield form(
        "empty unit brackets",
        "time (),gyro_x [],gyro_y [],gyro_z []\n",
        "{s:.6f},{d3}",
        "asks",
        **DEG,
    )
    yield form("unnamed index", ",time_s,gyro_x,gyro_y,gyro_z\n", "{i},{s:.6f},{d3}", "asks", **DEG)
    yield form(
        "heart rate alone",
        "time_s,heart_rate,steps\n",
        "{s:.6f},70.0,{i}",
        "no column looks like a gyro",
        gyro=None,
    )


def layouts():
    """Yield the forms that differ in how rows and cells are written."""
    yield form(
        "units second row",
        "time,gx,gy,gz,ax,ay,az\n[s],[deg/s],[deg/s],[deg/s],[g],[g],[g]\n",
        "{s:.6f},{d3},{g3}",
        **DEG,
        **IN_G,
    )
    labels = "gx:{dx:.4f},gy:{dy:.4f},gz:{dz:.4f}"
    yield form("arduino plotter labels", "", labels, "give rate=", to=1e-4, **DEG)
    yield form(
        "arduino plotter tabs",
        "",
        "gx: {dx:.4f},gy: {dy:.4f},gz: {dz:.4f}",
        "give rate=",
        tabs=True,
        to=1e-4,
        file="log.txt",
        **DEG,
    )
    yield form(
        "arduino ide monitor stamps",
        "",
        "{clock} -> {dx:.4f},{dy:.4f},{dz:.4f}",
        "asks",
        to=1e-4,
        file="log.txt",
        **DEG,
    )
    yield form(
        "utf16 excel",
        "Time [s],Gyro X [°/s],Gyro Y [°/s],Gyro Z [°/s]\n",
        "{s:.6f},{d3}",
        tabs=True,
        encoding="utf-16",
        file="log.txt",
        **DEG,
    )
    yield form(
        "latin1 degrees",
        "Time [s],Gyro X [°/s],Gyro Y [°/s],Gyro Z [°/s]\n",
        "{s:.6f},{d3}",
        encoding="latin-1",
        **DEG,
    )
    whole = form("", "millis,gx,gy,gz\n", "{ms},{d3}")
    lines = whole.text.splitlines(keepends=True)
    again = "".join([*lines[:601], lines[0], *lines[601:]])
    yield Form("header again", again, "asks", gyro="deg/s")
    yield form(
        "decimal comma tabs",
        "time_s\tgyro_x\tgyro_y\tgyro_z\n",
        "{s:.6f}\t{dx:.6f}\t{dy:.6f}\t{dz:.6f}",
        "asks",
        decimal=",",
        **DEG,
    )
    yield form(
        "decimal comma in commas",
        "time,gyro_x,gyro_y,gyro_z\n",
        "{s:.6f},{d3}",
        "decimal comma",
        decimal=",",
        **DEG,
    )


def clocks():
    """Yield the forms that differ in their time."""
    named = "gyro_x,gyro_y,gyro_z\n"
    yield form("excel serial days", "timestamp," + named, "{days:.10f},{w3}", "asks")
    yield form("excel serial days date", "date," + named, "{days:.10f},{w3}", "asks")
    yield form("time of day", "time," + named, "{clock},{w3}", "asks")
    yield form("iso seconds only", "time," + named, "{when:%Y-%m-%dT%H:%M:%S},{w3}", "asks")
    yield form(
        "hms columns",
        "hour,minute,second,ms," + named,
        "{when:%H},{when:%M},{when:%S},{part},{w3}",
        "asks",
    )
    yield form(
        "timestamp s and us", "timestamp_s,timestamp_us," + named, "{s:.6f},{us},{w3}", "asks"
    )
    yield form("time 5hz ms unnamed", "time," + named, "{ms},{d3}", "5 Hz", rate=5.0, **DEG)
    yield form("time 1hz s unnamed", "time," + named, "{s:.0f},{d3}", "1 Hz", rate=1.0, **DEG)
    yield form("ms 5hz", "millis_since_start," + named, "{ms},{d3}", "asks", rate=5.0, **DEG)
    yield form(
        "sample index time",
        "sample,gyro_x_dps,gyro_y_dps,gyro_z_dps\n",
        "{i},{d3}",
        "give rate=",
        **DEG,
    )


def forms():
    """Return all forms, each under a name of its own."""
    made = [*phones(), *trackers(), *autopilots(), *spellings(), *layouts(), *clocks()]
    assert len({one.name for one in made}) == len(made)
    return made
