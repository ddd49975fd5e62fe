"""Compression of a results file when its run is complete.

While a run goes its chunks keep their places in the file, so that a kill leaves what was there; a compressed chunk
changes its size, and would have to move. So the chunks are compressed into a new file at the end, by the filters
that every HDF5 reader knows, byte shuffle and deflate. The signals of a storm lose a quarter of their size: what is
left are digits of double precision. ISA-L deflates ten times faster than zlib, to the same format.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
from isal import isal_zlib

LEVEL = 1  # of deflate in ISA-L, whose levels are 0 to 3
_AHEAD = 64  # chunks that wait for compression
_THREADS = 2
_SCALES = ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST")  # attributes that `make_scale` and `attach_scale` write


def pack(source: Path, destination: Path) -> None:
    """Write a results file again with its chunks compressed.

    Raises
    ------
    OSError
        When it cannot be written, as on a full disk; the source is as it was.
    """
    with (
        h5py.File(source, "r") as old,
        h5py.File(destination, "w", track_order=True) as new,
        ThreadPoolExecutor(_THREADS) as threads,
    ):
        new.attrs.update(old.attrs)
        for name, group in old.items():
            packed = new.create_group(name, track_order=True)
            packed.attrs.update(group.attrs)
            for key, dataset in group.items():
                _create(packed, key, dataset)
        waiting: list[tuple[h5py.Dataset, tuple[int, ...], Future[bytes]]] = []
        for name, offset, chunk in _chunks(old):
            waiting.append((new[name], offset, threads.submit(_deflated, chunk)))
            if len(waiting) == _AHEAD:
                _write(waiting)
        _write(waiting)


def _create(group: h5py.Group, name: str, like: h5py.Dataset) -> None:
    """An empty dataset of the same shape, attributes and dimension scale; the scale is the group's first dataset."""
    dataset = group.create_dataset(
        name,
        shape=like.shape,
        maxshape=like.maxshape,
        chunks=like.chunks,
        dtype=like.dtype,
        fillvalue=like.fillvalue,
        shuffle=True,
        compression="gzip",
        compression_opts=LEVEL,
    )
    dataset.attrs.update({key: value for key, value in like.attrs.items() if key not in _SCALES})
    if name == "time":
        dataset.make_scale("time")
    else:
        dataset.dims[0].attach_scale(group["time"])


def _chunks(file: h5py.File) -> Iterator[tuple[str, tuple[int, ...], bytes]]:
    """Name of the dataset, place and bytes of every chunk that takes room, uncompressed as a run writes them."""
    for group in file.values():
        for dataset in group.values():
            for k in range(dataset.id.get_num_chunks()):
                offset = dataset.id.get_chunk_info(k).chunk_offset
                yield dataset.name, offset, dataset.id.read_direct_chunk(offset)[1]


def _deflated(chunk: bytes) -> bytes:
    """A chunk of 8-byte numbers by HDF5's filters shuffle and deflate."""
    shuffled = np.frombuffer(chunk, dtype=np.uint8).reshape(-1, 8).T.tobytes()
    return isal_zlib.compress(shuffled, LEVEL)


def _write(waiting: list[tuple[h5py.Dataset, tuple[int, ...], Future[bytes]]]) -> None:
    for dataset, offset, future in waiting:
        dataset.id.write_direct_chunk(offset, future.result())
    waiting.clear()
