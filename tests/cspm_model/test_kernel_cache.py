from numba import config

from cspm_model.kernel_cache import kernel_digest, use_kernel_cache


def test_any_change_to_any_kernel_file_gives_another_digest(tmp_path):
    (tmp_path / "a.py").write_text("import numba\nx = 1\n")
    (tmp_path / "b.py").write_text("from numba import njit\ny = 2\n")
    first = kernel_digest(tmp_path)
    (tmp_path / "note.txt").write_text("not code, though it names numba")
    (tmp_path / "d.py").write_text("no_kernel = 1\n")
    assert kernel_digest(tmp_path) == first
    (tmp_path / "b.py").write_text("from numba import njit\ny = 3\n")
    changed = kernel_digest(tmp_path)
    (tmp_path / "b.py").rename(tmp_path / "c.py")
    assert len({first, changed, kernel_digest(tmp_path)}) == 3


def test_the_cache_lies_where_the_user_wants_it(tmp_path, monkeypatch):
    monkeypatch.setattr(config, "CACHE_DIR", "elsewhere")
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    use_kernel_cache()
    assert config.CACHE_DIR.startswith(f"{tmp_path}/kernels-")
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    use_kernel_cache()
    assert "/cspm_model/kernels/__pycache__/kernels-" in config.CACHE_DIR
