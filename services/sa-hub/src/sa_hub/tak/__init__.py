"""The squad at the table of TAK users: Cursor on Target out and in, as XML or TAK protobuf."""
