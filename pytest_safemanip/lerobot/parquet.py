"""Parquet files, by pyarrow."""

from __future__ import annotations

import importlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pytest_safemanip.errors import ConfigError, install_command

_PANDAS_INDEX = "__index_level_0__"


def pyarrow(module: str = "") -> Any:
    """pyarrow, or a module of it.

    Raises:
        ConfigError: if it is not installed.
    """
    try:
        return importlib.import_module(f"pyarrow{module}")
    except ImportError as error:
        raise ConfigError(
            f"LeRobot's datasets need pyarrow: {install_command('lerobot')} ({error})"
        ) from error


def write_columns(path: Path, columns: Mapping[str, Any]) -> None:
    """Write arrays (N,) and (N, K), or lists of N values; the folder is made."""
    write_table(path, pyarrow().table({name: _column(values) for name, values in columns.items()}))


def write_indexed(path: Path, index: Sequence[str], column: str, values: Sequence[int]) -> None:
    """Write a column as pandas has it in a frame with an index of texts."""
    table = pyarrow().table({column: list(values), _PANDAS_INDEX: list(index)})
    about = {
        "index_columns": [_PANDAS_INDEX],
        "columns": [
            {"name": column, "field_name": column, "pandas_type": "int64", "numpy_type": "int64"},
            {
                "name": None,
                "field_name": _PANDAS_INDEX,
                "pandas_type": "unicode",
                "numpy_type": "object",
            },
        ],
        "column_indexes": [],
        "pandas_version": "2.0.0",
    }
    write_table(path, table.replace_schema_metadata({"pandas": json.dumps(about)}))


def write_table(path: Path, table: Any) -> None:
    """Write a table; the folder is made."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pyarrow(".parquet").write_table(table, path)


def _column(values: Any) -> Any:
    if isinstance(values, np.ndarray) and values.ndim == 2:
        flat = pyarrow().array(values.ravel())
        return pyarrow().FixedSizeListArray.from_arrays(flat, values.shape[1])
    return pyarrow().array(values)
