"""Memory that was freed goes back to the system."""

import ctypes
import platform

import psutil
import pytest

from cspm_ident.freed_memory import give_back

PIECE, PIECES = 100_000, 2000


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="of glibc's allocator")
def test_freed_pieces_go_back_though_a_later_one_is_in_use():
    process = psutil.Process()
    pieces = [bytearray(PIECE) for _ in range(PIECES)]
    last = pieces.pop()
    held = process.memory_info().rss
    del pieces
    give_back()
    assert held - process.memory_info().rss > 0.5 * PIECE * PIECES
    assert len(last) == PIECE


def test_another_c_library_is_left_alone(monkeypatch):
    monkeypatch.setattr(ctypes, "CDLL", lambda _: object())
    give_back()
