"""The files of `docs/reference/schemas`, from the models that the readers use.

Run `python docs/scripts/schema_files.py` after changing a key of a file.
"""

from pathlib import Path

from cspm.schemas.file_schema import KINDS, schema_of
from cspm_run.output.json_file import write_json

FOLDER = Path(__file__).resolve().parents[1] / "reference" / "schemas"

if __name__ == "__main__":
    for kind in KINDS:
        write_json(FOLDER / f"{kind}.schema.json", schema_of(kind))
