"""Files of GNSS receivers, made line by line."""

import functools
import json
import operator


def sentence(content):
    """Return a sentence of NMEA with its checksum, from what stands between $ and *."""
    total = functools.reduce(operator.xor, content.encode())
    return f"${content}*{total:02X}"


def minutes(angle, digits=2):
    """Return an angle as degrees and minutes, ddmm.mmmmmm."""
    degrees = int(abs(angle))
    return f"{degrees:0{digits}d}{60.0 * (abs(angle) - degrees):010.7f}"


def place(latitude, longitude):
    north, east = "NS"[latitude < 0], "EW"[longitude < 0]
    return f"{minutes(latitude)},{north},{minutes(longitude, 3)},{east}"


def gga(clock, latitude, longitude, height=100.0, geoid="47.5", quality=4, satellites=12):
    told = f"{quality},{satellites:02d},0.6,{height:.3f},M,{geoid},M,1.0,0000"
    return sentence(f"GNGGA,{clock},{place(latitude, longitude)},{told}")


def rmc(clock, latitude, longitude, knots="10.0", course="90.0", date="010524", status="A"):
    told = f"{status},{place(latitude, longitude)},{knots},{course},{date},,,A"
    return sentence(f"GNRMC,{clock},{told}")


def gst(clock, north=0.02, east=0.01, up=0.03):
    return sentence(f"GNGST,{clock},1.0,,,,{north},{east},{up}")


def vtg(course="180.0", kmph="36.0"):
    return sentence(f"GNVTG,{course},T,,M,19.4,N,{kmph},K,A")


def nmea(path, lines):
    path.write_bytes("\r\n".join([*lines, ""]).encode())
    return path


SOLUTION_HEAD = (
    "% program   : RTKPOST ver.demo5\n"
    "% inp file  : rover.obs\n"
    "%\n"
    "% (lat/lon/height=WGS84/ellipsoidal,Q=1:fix,2:float,3:sbas,4:dgps,5:single,6:ppp)\n"
)
SOLUTION_COLUMNS = (
    "%  GPST                  latitude(deg) longitude(deg)  height(m)   Q  ns   sdn(m)   sde(m)"
    "   sdu(m)  sdne(m)  sdeu(m)  sdun(m) age(s)  ratio    vn(m/s)    ve(m/s)    vu(m/s)"
    "      sdvn     sdve     sdvu    sdvne    sdveu    sdvun\n"
)


def solution_row(clock, i=0):
    return (
        f"2024/05/01 {clock}   40.0991{i:05d} -105.1461{i:05d}  1500.1234   1  12   0.0100   0.0090"
        "   0.0250   0.0010   0.0020   0.0030   0.20   12.5    1.50000   -2.50000    0.25000"
        "   0.05000  0.04000  0.09000  0.00100  0.00100  0.00100\n"
    )


def message(i, latitude=-33.9, status=0, covariance=(4.0, 0, 0, 0, 9.0, 0, 0, 0, 16.0), kind=2):
    """Return a message of NavSatFix as a dict."""
    stamp = {"secs": 1_714_564_800 + i // 5, "nsecs": i % 5 * 200_000_000}
    return {
        "header": {"seq": i, "stamp": stamp, "frame_id": "gps"},
        "status": {"status": status, "service": 1},
        "latitude": latitude + 1e-6 * i,
        "longitude": 151.2,
        "altitude": 30.0 + i,
        "position_covariance": list(covariance),
        "position_covariance_type": kind,
    }


def json_lines(path, messages):
    path.write_text("".join(json.dumps(one) + "\n" for one in messages))
    return path


def bag_csv(path, messages):
    """Write messages as bagpy does: a column a field."""
    names = (
        "Time", "header.seq", "header.stamp.secs", "header.stamp.nsecs", "header.frame_id",
        "status.status", "status.service", "latitude", "longitude", "altitude",
        *(f"position_covariance_{i}" for i in range(9)), "position_covariance_type",
    )  # fmt: skip
    rows = [",".join(names)]
    for one in messages:
        header, status = one["header"], one["status"]
        stamp = header["stamp"]
        cells = [
            1.7e9, header["seq"], stamp["secs"], stamp["nsecs"], header["frame_id"],
            status["status"], status["service"], one["latitude"], one["longitude"],
            one["altitude"], *one["position_covariance"], one["position_covariance_type"],
        ]  # fmt: skip
        rows.append(",".join(map(str, cells)))
    path.write_text("\n".join(rows) + "\n")
    return path


def echo_csv(path, messages):
    """Write messages as ``rostopic echo -p`` does."""
    fields = [f"field.position_covariance{i}" for i in range(9)]
    names = [
        "%time", "field.header.seq", "field.header.stamp", "field.header.frame_id",
        "field.status.status", "field.status.service", "field.latitude", "field.longitude",
        "field.altitude", *fields, "field.position_covariance_type",
    ]  # fmt: skip
    rows = [",".join(names)]
    for one in messages:
        header, status = one["header"], one["status"]
        stamp = header["stamp"]["secs"] * 10**9 + header["stamp"]["nsecs"]
        cells = [
            stamp + 5_000_000, header["seq"], stamp, header["frame_id"], status["status"],
            status["service"], one["latitude"], one["longitude"], one["altitude"],
            *one["position_covariance"], one["position_covariance_type"],
        ]  # fmt: skip
        rows.append(",".join(map(str, cells)))
    path.write_text("\n".join(rows) + "\n")
    return path
