"""Live loop with asyncio: ``python examples/asyncio_stream.py [--seconds 2] [--rate 200]``.

A gyro sends one line per sample over a local connection. The server answers each line with the
compensated rate before it reads the next line. Meanwhile a task prints the bias and its standard
deviation. Another task saves the filter outside the loop, so that no answer waits for the disk.
"""

import argparse
import asyncio
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import zerorate as zr
from zerorate.record import atomic_path

BIAS = np.array([0.5, -0.2, 1.0])
NOISE = 0.05


@dataclass
class Compensator:
    """Server that answers the samples of a connection; it runs on the loop and needs no locks."""

    gyro: zr.DriftFilter

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer a connection until it is closed."""
        async for line in reader:
            rate = self.gyro.update(np.fromstring(line.decode(), sep=","))
            writer.write((",".join(f"{r:.6f}" for r in rate) + "\n").encode())
            # This waits only if the other side does not read.
            await writer.drain()
        writer.close()

    async def tell(self, every: float) -> None:
        """Print the state of the filter from time to time."""
        while True:
            await asyncio.sleep(every)
            bias = " ".join(f"{b:+.3f}" for b in self.gyro.bias)
            sigma = " ".join(f"{s:.3f}" for s in self.gyro.bias_sigma)
            print(f"{self.gyro.samples_seen:6d} samples, bias {bias}, sigma {sigma}")

    async def save(self, path: Path, every: float) -> None:
        """Write checkpoints; their bytes are created between two samples."""
        while True:
            await asyncio.sleep(every)
            await asyncio.to_thread(write, path, self.gyro.to_bytes())


def write(path: Path, raw: bytes) -> None:
    """Write a complete file, or keep the old file."""
    with atomic_path(path, force=True) as temporary:
        temporary.write_bytes(raw)


async def sensor(port: int, seconds: float, rate: float) -> float:
    """Send simulated samples in real time; return the mean of the second half of the answers."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    loop = asyncio.get_running_loop()
    begin, answers = loop.time(), []
    z = BIAS + NOISE * np.random.default_rng(1).standard_normal((round(seconds * rate), 3))
    for i, sample in enumerate(z):
        await asyncio.sleep(begin + i / rate - loop.time())
        writer.write((",".join(map(repr, sample.tolist())) + "\n").encode())
        answers.append(np.fromstring((await reader.readline()).decode(), sep=","))
    writer.close()
    await writer.wait_closed()
    return float(np.abs(np.mean(answers[len(answers) // 2 :], axis=0)).max())


async def live(seconds: float, rate: float, checkpoint: Path) -> None:
    """Run the server, the sensor and the tasks until the sensor ends."""
    gyro = zr.DriftFilter(rate, method="auto", output="compensated", channels=3)
    compensator = Compensator(gyro)
    server = await asyncio.start_server(compensator.serve, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    beside = [
        asyncio.create_task(compensator.tell(seconds / 4.0)),
        asyncio.create_task(compensator.save(checkpoint, seconds / 4.0)),
    ]
    try:
        left = await sensor(port, seconds, rate)
    finally:
        for task in beside:
            task.cancel()
        await asyncio.gather(*beside, return_exceptions=True)
        server.close()
    saved = zr.DriftFilter.from_bytes(checkpoint.read_bytes())
    print(f"mean rate at rest after compensation: {left:.4f} of {np.abs(BIAS).max()}")
    print(f"the last checkpoint holds {saved.samples_seen} samples")


def main() -> None:
    """Run the loop for a while."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--seconds", type=float, default=2.0)
    options.add_argument("--rate", type=float, default=200.0, help="samples per second")
    arguments = options.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        asyncio.run(live(arguments.seconds, arguments.rate, Path(folder) / "gyro.state"))


if __name__ == "__main__":
    main()
