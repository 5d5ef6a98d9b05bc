"""Recordings that were cut off: what whole chunks they hold is copied into a file with an index."""

import tempfile
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO

from mcap.reader import make_reader
from mcap.records import Attachment, Channel, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer


def open_whole(path: Path) -> IO[bytes]:
    """A recording that has an index: the file itself, or a temporary copy of what one that was cut off holds.

    Raises:
        OSError: It cannot be read.
    """
    file = path.open("rb")
    # where a file has not the end that it should have, the reader finds and raises whatever there is
    with suppress(Exception):
        if make_reader(file).get_summary() is not None:
            file.seek(0)
            return file
    with file:
        return recovered(file)


def recovered(damaged: IO[bytes]) -> IO[bytes]:
    """A temporary copy of everything that can be read, up to the first damage."""
    damaged.seek(0)
    whole = tempfile.TemporaryFile()  # noqa: SIM115 - whoever asked for it closes it
    writer = Writer(whole, compression=CompressionType.NONE)
    writer.start()
    schemas, channels = {0: 0}, dict[int, int]()
    for record in _readable(damaged):
        match record:
            case Attachment():
                writer.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
            case Schema():
                schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            case Channel():
                schema = schemas[record.schema_id]
                channels[record.id] = writer.register_channel(
                    record.topic, record.message_encoding, schema, record.metadata
                )
            case Message():
                channel = channels[record.channel_id]
                writer.add_message(
                    channel, record.log_time, record.data, record.publish_time, record.sequence
                )
    writer.finish()  # type: ignore[no-untyped-call]  # mcap has no types
    whole.seek(0)
    return whole


def _readable(damaged: IO[bytes]) -> Iterator[McapRecord]:
    """The records up to the end of the data, or to the first damage."""
    # readers and decompressors raise whatever comes to them; chunks are checked by their sums
    with suppress(Exception):
        yield from StreamReader(damaged, validate_crcs=True).records
