"""Python clients of a served machine (`macromicro serve`), synchronous and for asyncio."""
